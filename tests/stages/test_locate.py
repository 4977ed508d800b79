"""Centroid tables become trajectories, with their flags, clocks, matches and honest sigmas."""

import numpy as np
import pandas as pd
import pytest

from tests.motion.tags import SIDE, SQUARE, poses, rig, seen
from vidtrack.association.tracklets import COLUMNS as COLUMNS_OF_TRACKLETS
from vidtrack.calibration.camera.refine import Uncertainty, free_parameters, refine
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import project
from vidtrack.geometry.picture_part import Picture
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.location.cameras.ball_sizes import px_per_unit
from vidtrack.location.cameras.run_pictures import Pictures
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.locate import locate, locate_run
from vidtrack.tags.poses import TagOrder

START = 36000.0
COLUMNS = ["time_s", "timecode", "target", "x", "y", "z", "sigma_x", "sigma_y", "sigma_z", "miss", "n_cameras", "flag"]


def pluck(t):
    decay = np.exp(-0.1 * t)
    swing = [24 * np.cos(2 * np.pi * t / 1.6), 0.6 * np.sin(2 * np.pi * t / 0.9), 0.4 * np.cos(2 * np.pi * t / 1.1)]
    return decay[:, None] * np.stack(swing, -1)


def other(t):
    """A second target that crosses the first one in every view."""
    return pluck(t)[:, [0, 1, 2]] * [-0.8, 1, 1] + [0, 2.5, 3]


def centroids(camera, paths, *, seconds=8.0, rate_hz=30.0, noise=0.1, rng, late=0.0, start=START, field="frame"):
    """A camera's table; `late` is what must be added to its clock."""
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    tables = []
    for name, path in paths.items():
        b = project(camera, path(t + late + start - START)) + rng.normal(0, noise, (t.size, 2))
        codes = [f"10:00:{int(x):02d}:{round(x * rate_hz) % 30:02d}" for x in t]
        tables.append(
            pd.DataFrame({"time_s": start + t, "timecode": codes, "target": name, "Xf": b[:, 0], "Yf": b[:, 1]})
        )
    table = pd.concat(tables, ignore_index=True)
    return table.assign(frame=0, field=field, pixels=50.0, flag="")


def errors(located, paths):
    """Errors (n, 3) in and errors over sigma, of all located samples."""
    table = located.trajectories.dropna(subset="x")
    truth = np.concatenate(
        [paths[name](rows["time_s"].to_numpy() - START) for name, rows in table.groupby("target", sort=False)]
    )
    off = table[["x", "y", "z"]].to_numpy() - truth
    return off, off / table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()


def run(n):
    """Tables and cameras of a plucked target."""
    cameras = thesis_rig(n)
    rng = np.random.default_rng(0)
    tables = {c.name: centroids(c, {"t1": pluck}, rng=rng) for c in cameras}
    return tables, {c.name: (c, None) for c in cameras}


@pytest.mark.parametrize(
    ("larger", "same_balls", "held"), [(0.006, True, True), (0.006, False, False), (0.0, True, False)]
)
def test_a_zoom_of_all_lenses_that_widths_hint_at_is_in_sigma_and_in_the_budget(larger, same_balls, held):
    tables, cameras = run(2)
    rng = np.random.default_rng(3)
    p, at = thesis_points()[1], START + np.arange(0, 240, 6) / 30
    points, widths = {}, {}
    for name, (camera, _) in cameras.items():
        b = project(camera, p)
        wide = px_per_unit(camera, p) * np.exp(rng.normal(0, 0.001, len(p)))
        points[name] = pd.DataFrame(dict(zip("xyz", p.T, strict=True)) | {"Xf": b[:, 0], "Yf": b[:, 1], "width": wide})
        there, own = project(camera, pluck(at - START)), px_per_unit(camera, pluck(at - START))
        widths[name] = {"1": {"time_s": at, "Xf": there[:, 0], "Yf": there[:, 1], "width": own * np.exp(larger)}}
    plain = locate(tables, cameras, targets=1)
    located = locate(tables, cameras, targets=1, points=points, widths=widths, same_balls=same_balls)
    sigma, before = (
        np.linalg.norm(one.trajectories[["sigma_x", "sigma_y", "sigma_z"]], axis=1) for one in (located, plain)
    )
    assert (np.median(sigma / before) > 1.5) == held
    assert [f["code"] for f in located.record["findings"]].count("zoom-in-sigma") == held
    if held:
        combined = [own["combined"] for own in located.record["uncertainty"]["axes"].values()]
        assert np.linalg.norm(combined) == pytest.approx(np.median(sigma), rel=0.3)


@pytest.mark.parametrize(("n", "inches"), [(2, 0.0366), (3, 0.0270), (4, 0.0218)])
def test_a_run_is_located_to_what_the_centroids_noise_allows(n, inches):
    tables, cameras = run(n)
    located = locate(tables, cameras, targets=1)
    assert list(located.trajectories.columns) == COLUMNS
    off, normalised = errors(located, {"t1": pluck})
    assert len(off) == 240
    assert np.linalg.norm(off, axis=-1).mean() == pytest.approx(inches, rel=0.08)
    assert np.mean(normalised**2, 0) == pytest.approx(np.ones(3), abs=0.25)
    assert located.record["noise"]["sd_px"]["cam1"] == pytest.approx(0.1, rel=0.1)
    assert (located.trajectories["flag"] == "").all()
    assert located.trajectories["timecode"].iloc[31] == "10:00:01:01"
    assert not located.record["warnings"]


def test_a_camera_lost_for_a_second_leaves_the_others():
    tables, cameras = run(3)
    gone = slice(60, 90)
    tables["cam2"].loc[60:89, ["Xf", "Yf"]] = np.nan
    tables["cam2"].loc[60:89, "flag"] = "lost"
    table = locate(tables, cameras, targets=1).trajectories
    assert (table["n_cameras"].iloc[gone] == 2).all()
    assert (table["flag"].iloc[gone] == "cam2:lost").all()
    assert table["x"].notna().all()
    assert table["sigma_y"].iloc[70] > 1.1 * table["sigma_y"].iloc[50]
    both = locate({k: tables[k] for k in ("cam1", "cam2")}, cameras, targets=1).trajectories
    assert both["x"].iloc[gone].isna().all()
    assert (both["flag"].iloc[gone] == "lost;cam2:lost").all()
    assert (both["n_cameras"].iloc[gone] == 0).all()
    assert both["x"].notna().sum() == 210


def test_two_targets_that_cross_and_bear_other_names_in_each_camera_are_told_apart():
    rng = np.random.default_rng(1)
    a, b = thesis_rig(2)
    tables = {
        "cam1": centroids(a, {"t1": pluck, "t2": other}, rng=rng),
        "cam2": centroids(b, {"t1": other, "t2": pluck}, rng=rng),
    }
    apart = (
        tables["cam1"].query("target == 't1'")["Xf"].to_numpy()
        - tables["cam1"].query("target == 't2'")["Xf"].to_numpy()
    )
    assert (np.diff(np.sign(apart)) != 0).any()  # they do cross in the picture
    located = locate(tables, {"cam1": (a, None), "cam2": (b, None)}, targets=2)
    off, _ = errors(located, {"t1": pluck, "t2": other})
    assert len(off) == 480
    assert np.linalg.norm(off, axis=-1).max() < 0.2
    match = located.record["correspondence"]
    assert match["targets"]["t1"]["tracks"] == {"cam1": ["t1"], "cam2": ["t2"]}
    assert match["tolerance"] == pytest.approx(match["tolerance_px"] * 0.2, rel=0.1)  # in, of 0.2 in/px
    assert not match["targets"]["t1"]["ambiguous"]


def test_names_that_the_user_gave_are_kept_in_all_cameras():
    rng = np.random.default_rng(2)
    cameras = thesis_rig(2)
    tables = {c.name: centroids(c, {"bow": pluck, "stern": other}, rng=rng) for c in cameras}
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=["bow", "stern"])
    assert located.trajectories["target"].unique().tolist() == ["bow", "stern"]
    only = {"cam1": tables["cam1"], "cam2": tables["cam2"].replace({"target": {"bow": "t2", "stern": "t1"}})}
    named = locate(only, {c.name: (c, None) for c in cameras}, targets=["bow", "stern"])
    assert named.trajectories["x"].to_numpy() == pytest.approx(located.trajectories["x"].to_numpy(), abs=1e-6)
    assert set(named.trajectories["target"]) == {"bow", "stern"}


def test_names_that_contradict_what_the_cameras_see_give_way_and_a_word_is_said():
    rng = np.random.default_rng(3)
    cameras = thesis_rig(2)
    tables = {c.name: centroids(c, {"bow": pluck, "stern": other}, rng=rng) for c in cameras}
    tables["cam2"] = tables["cam2"].replace({"target": {"bow": "stern", "stern": "bow"}})
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=["bow", "stern"])
    assert any("names do not agree between cameras: " in w for w in located.record["warnings"])
    assert located.trajectories["x"].notna().all()


def test_a_clock_from_the_config_is_added_to_the_cameras_time():
    rng = np.random.default_rng(4)
    a, b = thesis_rig(2)
    late = 0.37 / 30
    tables = {"cam1": centroids(a, {"t1": pluck}, rng=rng), "cam2": centroids(b, {"t1": pluck}, rng=rng, late=late)}
    clocks = {"cam1": {"offset_s": 0.0, "rate_ppm": 0.0}, "cam2": {"offset_s": late, "rate_ppm": 0.0}}
    located = locate(tables, {"cam1": (a, None), "cam2": (b, None)}, targets=1, clocks=clocks)
    off, normalised = errors(located, {"t1": pluck})
    assert len(off) == len(located.trajectories) == 239  # the first moment of cam1 is before cam2's first
    assert np.linalg.norm(off, axis=-1).mean() < 0.037
    assert np.mean(normalised**2, 0) == pytest.approx(np.ones(3), abs=0.3)
    # a cubic between samples, 0.63 of an interval on, has 0.82 of their noise
    sd = located.record["noise"]["sd_px"]
    assert sd["cam2"] / sd["cam1"] == pytest.approx(0.82, abs=0.01)


@pytest.mark.parametrize("clocks", ["auto", {"cam2": "auto"}])
def test_clocks_are_found_from_the_motion(clocks):
    rng = np.random.default_rng(5)
    a, b = thesis_rig(2)
    tables = {
        "cam1": centroids(a, {"t1": pluck, "t2": other}, rng=rng, noise=0.03),
        "cam2": centroids(b, {"t1": other, "t2": pluck}, rng=rng, noise=0.03, late=0.37 / 30),
    }
    located = locate(tables, {"cam1": (a, None), "cam2": (b, None)}, targets=2, clocks=clocks)
    told = located.record["clocks"]["cameras"]["cam2"]
    assert told["offset_s"] * 30 == pytest.approx(0.37, abs=0.02)
    assert told["offset_s_95"][0] < told["offset_s"] < told["offset_s_95"][1]
    assert told["source"] == "motion"
    assert told["offsets_s"][np.argmin(told["error_px"])] == pytest.approx(told["offset_s"], abs=0.003)
    off, normalised = errors(located, {"t1": pluck, "t2": other})
    assert np.linalg.norm(off, axis=-1).mean() < 0.014
    assert 0.6 < np.mean(normalised**2) < 1.5
    # what the clock may be off by widens sigma where the target is fast, and nowhere else
    known = {"cam2": {"offset_s": told["offset_s"], "rate_ppm": told["rate_ppm"]}}
    bare = locate(tables, {"cam1": (a, None), "cam2": (b, None)}, targets=2, clocks=known).trajectories
    wider = (located.trajectories["sigma_x"] / bare["sigma_x"]).to_numpy()[:48]
    speed = np.abs(np.gradient(located.trajectories["x"].to_numpy()))[:48]
    assert wider[np.nanargmax(speed)] > 1.007
    assert wider[np.nanargmin(speed)] < 1.002


def test_interlaced_fields_are_samples_of_their_own():
    rng = np.random.default_rng(6)
    cameras = thesis_rig(2)
    tables = {c.name: centroids(c, {"t1": pluck}, rng=rng, rate_hz=60 / 1.001, seconds=4) for c in cameras}
    for table in tables.values():
        table["field"] = np.where(np.arange(len(table)) % 2, "bottom", "top")
    off, _ = errors(locate(tables, {c.name: (c, None) for c in cameras}, targets=1), {"t1": pluck})
    assert len(off) == 240
    assert np.linalg.norm(off, axis=-1).mean() == pytest.approx(0.0366, rel=0.1)


def test_a_recording_that_passes_midnight_meets_the_others():
    rng = np.random.default_rng(7)
    a, b = thesis_rig(2)
    tables = {
        "cam1": centroids(a, {"t1": pluck}, rng=rng, start=86398.0),
        "cam2": centroids(b, {"t1": pluck}, rng=rng, start=86398.0),
    }
    for table in tables.values():
        table[["Xf", "Yf"]] = centroids(a if table is tables["cam1"] else b, {"t1": pluck}, rng=rng)[["Xf", "Yf"]]
    tables["cam2"]["time_s"] -= 86400.0  # switched on a little after midnight by its own count
    assert locate(tables, {"cam1": (a, None), "cam2": (b, None)}, targets=1).trajectories["x"].notna().sum() == 240


def test_a_camera_that_follows_something_else_for_a_while_is_left_out():
    tables, cameras = run(4)
    tables["cam3"].loc[100:119, "Xf"] += 25
    table = locate(tables, cameras, targets=1).trajectories
    assert (table["flag"].iloc[100:120] == "cam3:left_out").all()
    assert (table["n_cameras"].iloc[100:120] == 3).all()
    off, _ = errors(locate(tables, cameras, targets=1), {"t1": pluck})
    assert np.linalg.norm(off, axis=-1).max() < 0.12


def test_two_cameras_that_disagree_give_no_guess():
    tables, cameras = run(2)
    tables["cam2"].loc[100:109, "Xf"] += 60
    located = locate(tables, cameras, targets=1)
    rows = located.trajectories.iloc[100:110]
    assert rows["x"].isna().all()
    assert (rows["flag"] == "disagree").all()
    assert (rows["miss"] > 1).all()
    assert any("do not see one point" in w for w in located.record["warnings"])


def test_a_fix_that_its_lines_miss_by_too_much_is_not_believed():
    tables, cameras = run(2)
    table = locate(tables, cameras, targets=1, max_miss=0.01).trajectories
    far = table["miss"] > 0.01
    assert 20 < far.sum() < 220
    assert (table["flag"][far] == "far").all()
    assert table["x"][far].isna().all()
    assert table["x"][~far].notna().all()


def test_targets_outside_the_calibrated_volume_are_counted():
    tables, cameras = run(2)
    volume = thesis_points()[1] * [0.5, 1, 1]  # 13.5 in to either side; the target swings 24
    located = locate(tables, cameras, targets=1, volume=volume)
    share = located.record["volume"]["share_outside"]
    assert share == pytest.approx(located.trajectories["outside"].mean())
    assert 0.2 < share < 0.7
    assert any("outside the calibrated volume" in w for w in located.record["warnings"])
    assert not locate(tables, cameras, targets=1, volume=volume * 3).trajectories["outside"].any()


@pytest.mark.slow
def test_sigma_holds_the_calibration_too():
    tags, hung = thesis_points()
    free = free_parameters("tsai")
    squares = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        p = hung + rng.normal(0, 1 / 8, hung.shape)
        cameras, points = {}, {}
        for c in thesis_rig(2):
            b = project(c, p) + rng.normal(0, 0.03, (64, 2))
            fit = refine(c, hung, b, free=free, sd=0.03, survey=1 / 8)
            cameras[c.name] = (fit.camera, fit.uncertainty)
            points[c.name] = pd.DataFrame(hung, columns=["x", "y", "z"]).assign(
                tag=tags, sigma=1 / 8, used=True, sd_x=0.03, sd_y=0.03
            )
        tables = {c.name: centroids(c, {"t1": pluck}, rng=rng, noise=0.03, seconds=3) for c in thesis_rig(2)}
        located = locate(tables, cameras, targets=1, points=points)
        squares.append(np.mean(errors(located, {"t1": pluck})[1] ** 2))
        apart = locate(tables, cameras, targets=1).trajectories["sigma_y"].mean()
        assert located.trajectories["sigma_y"].mean() > 1.03 * apart  # both cameras believed the same survey
        assert located.record["noise"]["sd_px"]["cam1"] == pytest.approx(0.03, rel=0.2)
    # 12 calibrations, each an error of its own: one sd of this mean is some 0.25
    assert 0.5 < np.mean(squares) < 1.6


def test_the_trackers_own_standard_deviations_weigh_the_cameras():
    rng = np.random.default_rng(8)
    a, b, c = thesis_rig(3)
    tables = {k.name: centroids(k, {"t1": pluck}, rng=rng, noise=sd) for k, sd in ((a, 0.05), (b, 0.05), (c, 0.5))}
    cameras = {k.name: (k, None) for k in (a, b, c)}
    plain = np.linalg.norm(errors(locate(tables, cameras, targets=1), {"t1": pluck})[0], axis=-1).mean()
    for name, sd in (("cam1", 0.1), ("cam2", 0.1), ("cam3", 1.0)):  # twice too large, as a tracker may say
        tables[name][["sd_x", "sd_y"]] = sd
    located = locate(tables, cameras, targets=1)
    off, normalised = errors(located, {"t1": pluck})
    assert np.linalg.norm(off, axis=-1).mean() < 0.6 * plain
    # cam3 shows hardly anything of what cam1 and cam2 do along each other's lines of sight: their sd stay as they are
    assert 0.2 < np.mean(normalised**2) < 1.25
    assert located.record["noise"]["sd_px"]["cam3"] == pytest.approx(0.5, rel=0.1)


def test_sd_that_are_too_large_are_made_smaller_where_three_cameras_show_all_of_the_errors():
    rng = np.random.default_rng(8)
    rig = thesis_rig(3)
    tables = {c.name: centroids(c, {"t1": pluck}, rng=rng, noise=0.05) for c in rig}
    for table in tables.values():
        table[["sd_x", "sd_y"]] = 0.1  # twice too large, as a tracker may say
    located = locate(tables, {c.name: (c, None) for c in rig}, targets=1)
    # each residual is taken to be made by one camera's noise alone: sd stay up to sqrt(2) too large
    assert 0.4 < np.mean(errors(located, {"t1": pluck})[1] ** 2) < 1.25
    assert 0.5 < located.record["noise"]["factor"] < 0.75


def test_one_target_that_lies_off_its_epipolar_line_is_matched_with_a_warning():
    tables, cameras = run(2)
    tables["cam2"]["Yf"] += 8
    located = locate(tables, cameras, targets=1)
    assert any("off each other's epipolar lines" in w for w in located.record["warnings"])
    assert located.trajectories["target"].unique().tolist() == ["t1"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tables, cameras: tables.pop("cam2"), r"locate: mode space needs two cameras.*cam1"),
        (lambda tables, cameras: cameras.pop("cam2"), r"locate: camera cam2 has no calibration"),
        (lambda tables, cameras: tables["cam2"].__setitem__("time_s", 5.0 + np.arange(240)), "at one moment"),
    ],
)
def test_what_cannot_be_located_is_refused_in_one_line(change, message):
    tables, cameras = run(2)
    change(tables, cameras)
    with pytest.raises(VidtrackError, match=message) as caught:
        locate(tables, cameras, targets=1)
    assert "\n" not in str(caught.value)


def test_a_run_without_a_single_centroid_gives_an_empty_table():
    tables, cameras = run(2)
    tables = {k: t.assign(Xf=np.nan, Yf=np.nan, flag="lost") for k, t in tables.items()}
    located = locate(tables, cameras, targets=1)
    assert list(located.trajectories.columns) == COLUMNS
    assert located.trajectories["x"].isna().all()
    empty = {k: t.iloc[:0] for k, t in tables.items()}
    with pytest.raises(VidtrackError, match="at one moment"):
        locate(empty, cameras, targets=1)


def test_a_still_is_a_run_of_one_moment():
    tables, cameras = run(2)
    still = locate({k: t.iloc[:1] for k, t in tables.items()}, cameras, targets=1).trajectories
    assert len(still) == 1
    assert still[["x", "y", "z"]].to_numpy()[0] == pytest.approx(pluck(np.zeros(1))[0], abs=0.2)
    sought = locate({k: t.iloc[:1] for k, t in tables.items()}, cameras, targets=1, clocks="auto")
    assert sought.trajectories["x"].notna().all()
    assert sought.record["clocks"]["cameras"]["cam2"]["source"] == "none"


def test_unknown_is_written_as_uncertain_not_as_zero():
    names = free_parameters("tsai")
    known = Uncertainty(names, np.zeros(3), np.full((len(names),) * 2, np.nan))
    tables, cameras = run(2)
    cameras["cam1"] = (cameras["cam1"][0], known)
    table = locate(tables, cameras, targets=1).trajectories
    assert table["x"].notna().all()
    assert table["sigma_x"].isna().all()


def test_a_run_filmed_at_half_size_is_located_as_well_and_said_to_be_scaled():
    """Centroids of half the picture, noise of half as many px: the same positions and sigmas."""
    tables, cameras = run(2)
    whole = locate(tables, cameras, targets=1)
    small = {n: t.assign(Xf=(t["Xf"] + 0.5) / 2 - 0.5, Yf=(t["Yf"] + 0.5) / 2 - 0.5) for n, t in tables.items()}
    pictures = {n: Pictures(Picture(512, 480), Picture(256, 240)) for n in tables}
    half = locate(small, cameras, targets=1, pictures=pictures)
    columns = ["x", "y", "z", "sigma_x", "sigma_y", "sigma_z"]
    np.testing.assert_allclose(half.trajectories[columns], whole.trajectories[columns], rtol=1e-4, atol=1e-4)
    assert [f["code"] for f in half.record["findings"]] == ["picture-scaled"] * 2
    assert half.record["pictures"]["cam1"]["width"] == 512


def test_a_pair_that_disagrees_is_not_believed_where_it_agrees_by_chance():
    """Two targets of one name: their lines pass within the limit now and then, tens of inches off."""
    rng = np.random.default_rng(9)
    a, b = thesis_rig(2)
    tables = {"cam1": centroids(a, {"t1": pluck}, rng=rng), "cam2": centroids(b, {"t1": other}, rng=rng)}
    located = locate(tables, {"cam1": (a, None), "cam2": (b, None)}, targets=["t1"])
    assert located.trajectories["x"].isna().all()
    assert (located.trajectories["flag"] == "disagree").all()
    codes = {f["code"]: f["level"] for f in located.record["findings"]}
    assert codes["match-contradicted"] == codes["cameras-disagree"] == "bad"


def test_centroids_of_much_noise_are_not_left_out_for_it():
    cameras = thesis_rig(3)
    tables = {c.name: centroids(c, {"t1": pluck}, rng=np.random.default_rng(1), noise=1.2) for c in cameras}
    known = {c.name: (c, None) for c in cameras}
    assert locate(tables, known, targets=1).trajectories["x"].notna().all()
    assert locate(tables, known, targets=1, tolerance_px=3.0).trajectories["x"].isna().any()


def test_names_exchanged_in_one_of_three_cameras_are_named_and_the_two_others_decide():
    rng = np.random.default_rng(3)
    cameras = thesis_rig(3)
    tables = {c.name: centroids(c, {"bow": pluck, "stern": other}, rng=rng) for c in cameras}
    tables["cam1"] = tables["cam1"].replace({"target": {"bow": "stern", "stern": "bow"}})
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=["bow", "stern"])
    (finding,) = [f for f in located.record["findings"] if f["code"] == "names-exchanged"]
    assert "cam1's bow is cam2's stern and cam3's stern" in finding["text"]
    off, _ = errors(located, {"bow": pluck, "stern": other})
    assert np.linalg.norm(off, axis=-1).max() < 0.2


def test_tracks_that_go_over_to_each_other_where_targets_met_are_no_fault_of_targets_csv():
    rng = np.random.default_rng(3)
    cameras = thesis_rig(3)
    tables = {c.name: centroids(c, {"bow": pluck, "stern": other}, rng=rng) for c in cameras}
    own = tables["cam1"]
    late = own["time_s"] > START + 4
    own.loc[late, "target"] = own.loc[late, "target"].map({"bow": "stern", "stern": "bow"})
    tracklets = own.assign(tracklet=(own["target"] == "stern") + 2 * late).reindex(columns=list(COLUMNS_OF_TRACKLETS))
    known = {c.name: (c, None) for c in cameras}
    located = locate(tables, known, targets=["bow", "stern"], tracklets={"cam1": tracklets})
    levels = {f["code"]: f["level"] for f in located.record["findings"]}
    assert levels == {"tracks-exchanged": "note"}
    off, _ = errors(located, {"bow": pluck, "stern": other})
    assert np.linalg.norm(off, axis=-1).max() < 0.2


def test_a_camera_that_turned_after_its_calibration_is_said():
    tables, cameras = run(3)
    camera = cameras["cam2"][0]
    R = rotation_from_vector([0, 0, np.radians(1.3)]) @ camera.R
    turned = camera.with_(R=R, T=-R @ camera.position)
    tables["cam2"] = centroids(turned, {"t1": pluck}, rng=np.random.default_rng(0), noise=0.03)
    for name in ("cam1", "cam3"):
        tables[name] = centroids(cameras[name][0], {"t1": pluck}, rng=np.random.default_rng(1), noise=0.03)
    record = locate(tables, cameras, targets=1).record
    (finding,) = record["findings"]
    assert (finding["level"], finding["code"]) == ("bad", "sight-lines-miss")
    assert "cam2 turned by 1.3" in finding["text"]
    assert record["warnings"] == [f"{finding['text']}. {finding['cure']}"]


def test_a_target_that_a_camera_took_for_none_is_found_among_what_else_it_followed():
    rng = np.random.default_rng(9)
    cameras = thesis_rig(2)
    tables = {c.name: centroids(c, {"t1": pluck, "t2": other}, rng=rng) for c in cameras}
    both = tables["cam2"]
    lost = both["target"] == "t2"
    tables["cam2"] = both.assign(
        Xf=both["Xf"].where(~lost), Yf=both["Yf"].where(~lost), flag=np.where(lost, "lost", "")
    )
    without = locate(tables, {c.name: (c, None) for c in cameras}, targets=2)
    assert without.trajectories["x"].notna().sum() == 240
    cut = both[lost].assign(tracklet=np.arange(240) // 80, target="")
    extra = {"cam2": cut.reindex(columns=list(COLUMNS_OF_TRACKLETS))}
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=2, tracklets=extra)
    off, _ = errors(located, {"t1": pluck, "t2": other})
    assert len(off) == 480
    assert np.linalg.norm(off, axis=-1).max() < 0.2
    assert located.trajectories["target"].unique().tolist() == ["t1", "t2"]
    assert located.record["correspondence"]["left_over"] == {}


def third(t):
    return pluck(t)[:, [1, 0, 2]] * [4, 0.3, 1] + [0, -6, -2]


def test_all_finds_how_many_there_are_and_gives_each_rows_from_its_first_fix_to_its_last():
    rng = np.random.default_rng(10)
    cameras = thesis_rig(3)
    tables = {c.name: centroids(c, {"t1": pluck, "t2": other, "t3": third}, rng=rng) for c in cameras}
    for table in tables.values():
        late = (table["target"] == "t3") & (table["time_s"] < START + 2)
        table.loc[late, ["Xf", "Yf"]] = np.nan
        table.loc[late, "flag"] = "lost"
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets="all")
    assert located.trajectories.groupby("target").size().to_dict() == {"t1": 240, "t2": 240, "t3": 180}
    assert np.linalg.norm(errors(located, {"t1": pluck, "t2": other, "t3": third})[0], axis=-1).max() < 0.2
    assert located.record["correspondence"]["targets"]["t3"]["start_s"] == pytest.approx(START + 2)
    assert located.record["findings"] == []


def test_fewer_targets_than_there_are_says_what_else_was_located_and_where():
    rng = np.random.default_rng(10)
    cameras = thesis_rig(3)
    tables = {c.name: centroids(c, {"t1": pluck, "t2": other, "t3": third}, rng=rng) for c in cameras}
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=2)
    (finding,) = [f for f in located.record["findings"] if f["code"] == "more-targets-located"]
    assert "3 things move or stand in space where 2 were asked for" in finding["text"]
    assert located.associations["target"].value_counts().to_dict()[""] == 3


def test_a_reflection_that_was_followed_is_located_as_no_target():
    rng = np.random.default_rng(11)
    cameras = thesis_rig(2)

    def rising(t):
        return pluck(t) * [0.4, 1, 3] + [0, 0, 6]

    def image(t):
        return rising(t) * [1, 1, -1]

    tables = {c.name: centroids(c, {"t1": rising, "t2": image}, rng=rng) for c in cameras}
    known = {c.name: (c, None) for c in cameras}
    located = locate(tables, known, targets=2)
    assert located.trajectories["target"].unique().tolist() == ["t1"]
    assert np.linalg.norm(errors(located, {"t1": rising})[0], axis=-1).max() < 0.2
    assert ("note", "mirror-images") in [(f["level"], f["code"]) for f in located.record["findings"]]
    named = locate(tables, known, targets=["t1", "t2"])  # as named by the user
    assert ("bad", "target-mirrored") in [(f["level"], f["code"]) for f in named.record["findings"]]


def test_a_stretch_that_may_be_of_either_target_is_located_under_both_names():
    rng = np.random.default_rng(12)
    cameras = thesis_rig(2)
    places = np.array([[[0, 0, 0], [10, 5, 0]], [[5, -5, 3], [5, 10, -3]]], float)

    def rests(k):
        return lambda t: np.where((t < 4)[:, None], places[0, k], places[1, k])

    tables = {c.name: centroids(c, {"t1": rests(0), "t2": rests(1)}, rng=rng) for c in cameras}
    for table in tables.values():
        hidden = table["time_s"].between(START + 3, START + 5)
        table.loc[hidden, ["Xf", "Yf"]] = np.nan
        table.loc[hidden, "flag"] = "merged"
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=2)
    counts = located.trajectories.groupby("target").agg(n=("x", "size"), found=("x", "count"))
    assert sorted(name for name in counts.index if "|" not in name) == ["t1", "t2"]
    assert set(counts.index) - {"t1", "t2"} == {"t1|t2", "t1|t2#2"}
    open_ = located.trajectories[located.trajectories["target"].str.contains("|", regex=False)]
    assert open_["x"].notna().all()
    assert open_["flag"].str.startswith("ambiguous").all()
    assert not located.trajectories.duplicated(["target", "time_s"]).any()
    assert "identity-open" in [f["code"] for f in located.record["findings"]]


FLOAT = {"bow": [6.0, 0.0, 0.0], "stern": [-4.0, 0.0, 0.0], "mast": [0.0, 1.0, 5.0]}


def on_float(name):
    def path(t):
        c, s = np.cos(0.2 * np.sin(2 * t)), np.sin(0.2 * np.sin(2 * t))
        x, y, z = FLOAT[name]
        return np.stack([3 * np.sin(t) + c * x - s * y, np.cos(2 * t) + s * x + c * y, z + 0 * t], -1)

    return path


def test_a_rigid_body_names_its_targets_where_the_tracker_took_them_as_they_came():
    rng = np.random.default_rng(13)
    cameras = thesis_rig(2)
    taken = {"bow": on_float("stern"), "stern": on_float("mast"), "mast": on_float("bow")}  # from top to bottom
    tables = {c.name: centroids(c, taken, rng=rng) for c in cameras}
    known = {c.name: (c, None) for c in cameras}
    located = locate(tables, known, targets=list(FLOAT), bodies={"float": FLOAT})
    off, _ = errors(located, {name: on_float(name) for name in FLOAT})
    assert np.linalg.norm(off, axis=-1).max() < 0.2
    assert "names-by-body" in [f["code"] for f in located.record["findings"]]
    right = {c.name: centroids(c, {n: on_float(n) for n in FLOAT}, rng=rng) for c in cameras}
    assert locate(right, known, targets=list(FLOAT), bodies={"float": FLOAT}).record["findings"] == []


def with_tags(n):
    """Tables and cameras of a tag and, where two cameras see it, of a target beside it."""
    names = [f"tag7_{k}" for k in range(1, 5)] + ["bow"] * (n > 1)
    body = np.concatenate([SQUARE, [[30.0, 20, 0]]])[: len(names)]
    sights = seen(rig(n), body, *poses(T=20)).b
    time = {"time_s": np.repeat(np.arange(20) / 30, len(names)), "target": names * 20, "flag": "", "timecode": ""}
    tables = {
        f"cam{i + 1}": pd.DataFrame(
            time | {"Xf": b[..., 0].ravel(), "Yf": b[..., 1].ravel(), "sd_x": 0.03, "sd_y": 0.03}
        )
        for i, b in enumerate(sights)
    }
    return tables, {f"cam{i + 1}": (camera, None) for i, camera in enumerate(rig(n))}


def test_a_run_with_coded_tags_has_their_centres_beside_targets_and_corners():
    tables, cameras = with_tags(2)
    done = locate_run(
        tables, cameras, tags=TagOrder(SIDE), targets=["bow"], clocks={"cam1": {}, "cam2": {}}, units="mm"
    )
    targets = done.trajectories.groupby("target").size()
    assert targets.to_dict() == dict.fromkeys(["bow", "tag7", *(f"tag7_{k}" for k in range(1, 5))], 20)
    origin = poses(T=20)[0]
    centre = done.trajectories[done.trajectories["target"] == "tag7"][["x", "y", "z"]].to_numpy()
    assert np.nanmax(np.abs(centre - origin)) < 1.0


def test_tags_that_one_camera_sees_are_trajectories_without_lines_of_sight_that_meet():
    tables, cameras = with_tags(1)
    done = locate_run(tables, cameras, tags=TagOrder(SIDE), targets=0, clocks={"cam1": "auto"}, units="mm")
    assert set(done.trajectories["target"]) == {"tag7", *(f"tag7_{k}" for k in range(1, 5))}
    assert done.record["samples"]["total"] == len(done.trajectories) == 100
    assert done.record["clocks"]["cameras"]["cam1"]["source"] == "config"
    assert done.associations.empty


def test_a_run_without_tags_and_read_outs_is_located_as_it_stands():
    tables, cameras = run(2)
    done = locate_run(tables, cameras, targets=1, clocks={name: {} for name in cameras})
    pd.testing.assert_frame_equal(done.trajectories, locate(tables, cameras, targets=1).trajectories)
