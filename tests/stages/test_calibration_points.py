"""Clips of balls in, a table of named positions out."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import points_on_wires, thesis_rig
from vidtrack.stages.calibration_points import calibration_points, picks_from_before

ONE_DOT = Path(__file__).parents[3] / "shared/real/one-dot"
CAMERA = thesis_rig()[0]
TAGS, PLACES = points_on_wires(rows=3, wires=3, balls=4, spacing=(24, 10, 8))
B = project(CAMERA, PLACES)
POINTS = pd.DataFrame(PLACES, columns=list("xyz")).assign(tag=TAGS)
SHOWN = {f"row{r + 1}": TAGS[12 * r : 12 * r + 12] for r in range(3)}
COLUMNS = [
    *("clip", "tag", "x", "y", "z", "sigma", "Xf", "Yf", "pixels", "width", "frames", "sd_x", "sd_y", "found"),
    "reason",
]


class F(NamedTuple):
    luma: np.ndarray
    corrupt: bool = False


def clip(at, *, n=4, seed=0, level=200.0, noise=2.0, radius=3.6, fine=6):
    """Frames with discs at (k, 2) px: counted on fine x fine points a pixel."""
    rng = np.random.default_rng(seed)
    image = np.full((480, 512), 20.0)
    offset = (np.arange(fine) + 0.5) / fine - 0.5
    for (x, y), high in zip(at, np.broadcast_to(level, len(at)), strict=True):
        left, top = int(x) - 6, int(y) - 6
        X = (left + np.arange(13)[:, None] + offset).ravel() - x
        Y = (top + np.arange(13)[:, None] + offset).ravel() - y
        share = (X[None] ** 2 + Y[:, None] ** 2 < radius**2).reshape(13, fine, 13, fine).mean((1, 3))
        image[top : top + 13, left : left + 13] += (high - 20) * share
    noisy = (image + rng.normal(0, noise, image.shape) for _ in range(n))
    return [F(np.clip(np.rint(picture), 0, 255).astype(np.uint8)) for picture in noisy]


def clips(change=None, **how):
    at = {name: B[[TAGS.index(t) for t in tags]] for name, tags in SHOWN.items()}
    return {name: clip((change or {}).get(name, b), seed=k, **how) for k, (name, b) in enumerate(at.items())}


def picks(*tags, name="row1", off=3.0):
    xy = B[[TAGS.index(t) for t in tags]] + off
    return pd.DataFrame({"clip": name, "tag": tags, "Xf": xy[:, 0], "Yf": xy[:, 1], "line": range(2, 2 + len(tags))})


FOUR = ("1", "4", "9", "12")


def test_every_ball_of_every_clip_is_named_and_measured():
    found = calibration_points(clips(), POINTS, picks(*FOUR), camera="cam1", tags=SHOWN, sigma=0.03)
    table = found.table
    assert table.columns.tolist() == COLUMNS
    assert table["tag"].tolist() == TAGS
    assert table["found"].all()
    error = table[["Xf", "Yf"]].to_numpy() - B
    # 2 grey levels on discs of 3.6 px and contrast 180, four frames: 0.003 px, and the pixels' sampling
    assert 0.001 < error.std() < 0.02
    assert (table["frames"] == 4).all()
    assert (table["sigma"] == 0.03).all()
    assert table["pixels"].between(30, 60).all()
    assert found.picture.shape == (480, 512)
    assert found.warnings == ()
    assert found.record["clips"]["row2"]["blobs_of_no_tag"] == []


def test_a_hidden_ball_keeps_its_row_and_a_stray_blob_gets_no_name():
    b = np.concatenate([np.delete(B[12:24], 4, 0), [[60, 60]], [[440, 100]]])
    found = calibration_points(clips({"row2": b}), POINTS, picks(*FOUR), camera="cam1", tags=SHOWN)
    lost = found.table[~found.table["found"]]
    assert lost["tag"].tolist() == ["17"]
    assert lost[["Xf", "Yf", "sd_x", "sd_y"]].isna().all(axis=None)
    assert "hidden or too dim" in lost["reason"].iloc[0]
    assert np.round(found.record["clips"]["row2"]["blobs_of_no_tag"]).tolist() == [[60, 60], [440, 100]]


def test_a_dim_ball_is_found_where_it_must_be():
    level = np.full(12, 200.0)
    level[7] = 55
    dim = clips() | {"row3": clip(B[24:36], level=level)}
    found = calibration_points(
        dim, POINTS, picks(*FOUR), camera="cam1", tags=SHOWN, detect={c: {"threshold": 90} for c in SHOWN}
    )
    row = found.table[found.table["tag"] == "32"].iloc[0]
    assert row["found"]
    assert [row["Xf"], row["Yf"]] == pytest.approx(B[31], abs=0.05)


def test_two_balls_that_touch_are_left_out_with_that_reason():
    b = B[:12].copy()
    b[5] = b[6] + (0, -6)
    found = calibration_points(clips({"row1": b}), POINTS, picks(*FOUR), camera="cam1", tags=SHOWN)
    lost = found.table[~found.table["found"]]
    assert set(lost["tag"]) <= {"6", "7"}
    assert "6" in set(lost["tag"])


def beside(world, offset):
    """A world point near `world` (3,) that is seen `offset` (2,) px beside it, by Newton's method."""
    wanted, at = project(CAMERA, world) + offset, world
    for _ in range(4):
        here = project(CAMERA, at)
        slope = np.stack([project(CAMERA, at + step) - here for step in 1e-3 * np.eye(3)], axis=-1) / 1e-3
        at = at + np.linalg.lstsq(slope, wanted - here, rcond=None)[0]
    return at


@pytest.mark.parametrize("gap", [9.0, 7.5, 6.0])
def test_two_balls_that_touch_where_both_are_surveyed_are_separated_by_one_fit(gap):
    world = PLACES.copy()
    world[5] = beside(world[6], np.array([0.3 * gap, -0.95 * gap]))
    b = project(CAMERA, world)
    points = POINTS.assign(x=world[:, 0], y=world[:, 1], z=world[:, 2])
    found = calibration_points(clips({"row1": b[:12]}), points, picks(*FOUR), camera="cam1", tags=SHOWN)
    table = found.table.iloc[[5, 6]]
    assert table["found"].all()
    error = table[["Xf", "Yf"]].to_numpy() - b[[5, 6]]
    sd = table[["sd_x", "sd_y"]].to_numpy()
    assert np.abs(error).max() < 0.1
    assert (np.abs(error) < 4 * sd).all()
    assert (sd < 0.1).all()


def test_a_ball_at_the_edge_of_the_picture_is_not_measured():
    shifted = {name: [F(f.luma[:, 170:].copy()) for f in frames] for name, frames in clips().items()}
    cut = B[:, 0] - 170
    four = picks("1", "4", "8", "5").assign(Xf=lambda t: t["Xf"] - 170)
    found = calibration_points(shifted, POINTS, four, camera="cam1", tags=SHOWN).table
    inside, edge, outside = cut > 5, (cut > -2.5) & (cut < 2.5), cut < -6
    assert outside.any() or edge.any()
    assert found["found"][inside].all()
    assert not found["found"][edge | outside].any()
    assert set(found["reason"][outside]) <= {"outside the picture"}


def test_a_tag_seen_in_two_clips_at_two_places_is_warned_of():
    moved = clips() | {"again": clip(_moved())}
    shown = SHOWN | {"again": TAGS[:12]}
    found = calibration_points(moved, POINTS, picks(*FOUR), camera="cam1", tags=shown)
    assert len(found.table) == 48
    assert len(found.warnings) == 1
    assert "calibration/again: tag 5 of camera cam1 lies (+1.0, +0.6) px" in found.warnings[0]


def _moved():
    b = B[:12].copy()
    b[4] += (1.0, 0.6)
    return b


@pytest.mark.slow
def test_a_clip_in_which_the_camera_had_moved_is_warned_of():
    found = calibration_points(clips({"row2": B[12:24] + 3}), POINTS, picks(*FOUR), camera="cam1", tags=SHOWN)
    assert found.table["found"].all()
    assert len(found.warnings) == 1
    assert "px from where the other clips put them. Did the camera move" in found.warnings[0]


def test_a_swinging_ball_is_warned_of():
    rng = np.random.default_rng(0)
    frames = []
    for k in range(8):
        b = B[:12].copy()
        b[3, 0] += rng.normal(0, 0.8)
        frames += clip(b, n=1, seed=k)
    found = calibration_points(clips() | {"row1": frames}, POINTS, picks(*FOUR), camera="cam1", tags=SHOWN)
    assert len(found.warnings) == 1
    assert "tag 4 moves 0." in found.warnings[0]
    assert found.table["sd_x"].idxmax() == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"tag": "99"}, r"row1/picks.csv, line 3: no tag 99 in points.csv"),
        ({"tag": "20"}, r"row1/picks.csv, line 3: clip row1 does not show tag 20"),
        ({"Xf": 600.0}, r"row1/picks.csv, line 3: tag 4 of camera cam1 at \(600, .*outside the picture of 512 x 480"),
        ({"clip": "row9"}, r"row9/picks.csv, line 3: camera cam1 has no clip row9"),
    ],
)
def test_a_pick_that_cannot_be_right_is_named_with_its_line(change, told):
    bad = picks(*FOUR)
    for name, value in change.items():
        bad.loc[1, name] = value
    with pytest.raises(VidtrackError, match=told):
        calibration_points(clips(n=1), POINTS, bad, camera="cam1", tags=SHOWN)


def test_swapped_picks_are_told_and_not_used():
    swapped = picks("1", "4", "5", "8", "9", "12")
    swapped.loc[[1, 4], ["Xf", "Yf"]] = swapped.loc[[4, 1], ["Xf", "Yf"]].to_numpy()
    found = calibration_points(clips(), POINTS, swapped, camera="cam1", tags=SHOWN)
    assert found.table["found"].all()
    assert np.abs(found.table[["Xf", "Yf"]].to_numpy() - B).max() < 0.1
    assert len(found.warnings) == 2
    assert "line 3: tag 4" in found.warnings[0]
    assert "tags 4 and 9 are swapped" in found.warnings[0]


def test_without_picks_a_symmetric_layout_asks_for_one():
    with pytest.raises(VidtrackError, match=r"because the layout is symmetric. Add the line that is true: cam1,"):
        calibration_points(clips(n=1), POINTS, None, camera="cam1", tags=SHOWN)


def test_a_clip_without_balls_says_what_would_find_them():
    dark = {name: [F(255 - f.luma) for f in frames] for name, frames in clips(n=1).items()}
    with pytest.raises(VidtrackError) as told:
        calibration_points(
            dark, POINTS, picks(*FOUR), camera="cam1", tags=SHOWN, detect={c: {"threshold": 250} for c in SHOWN}
        )
    assert len(told.value.problems) == 3
    assert "threshold: auto with polarity: dark finds 12" in told.value.problems[0]


def test_unknown_tags_sizes_that_differ_and_clips_without_frames_are_refused():
    with pytest.raises(VidtrackError, match=r"clips.row1.tags: no point 77 in points.csv"):
        calibration_points(clips(n=1), POINTS, None, tags={"row1": ["77"]})
    other = clips(n=1) | {"row2": [F(np.zeros((240, 256), np.uint8))]}
    with pytest.raises(VidtrackError, match="row2: camera cam1 has 256 x 240 px here, but 512 x 480 in row1"):
        calibration_points(other, POINTS, None, camera="cam1", tags=SHOWN)
    with pytest.raises(VidtrackError, match="calibration/row2: no frame to use"):
        calibration_points(clips(n=1) | {"row2": []}, POINTS, None, camera="cam1", tags=SHOWN)


def test_a_ball_from_before_the_test_is_picked_in_the_first_clip_that_shows_it():
    before = pd.DataFrame({"tag": ["1", "2", "2", "3"], "Xf": [1.0, 2.0, 9.0, 3.0], "Yf": 0.0})
    before = before.assign(found=[True, True, True, False])
    found = picks_from_before(before, {"row9": ["3"], "row1": ["2"], "row2": ["1", "2", "3"]}, "before.parquet")
    assert found[["clip", "tag", "Xf"]].to_numpy().tolist() == [["row1", "2", 2.0], ["row2", "1", 1.0]]
    assert set(found["file"]) == {"before.parquet"}
    assert picks_from_before(before, {"row9": ["7"]}, "before.parquet") is None


@pytest.mark.skipif(not ONE_DOT.exists(), reason="the real inputs are not here")
@pytest.mark.parametrize("camera", ["cam1", "cam2", "cam3", "cam4"])
def test_every_dot_of_a_real_target_is_named(camera, tmp_path):
    from vidtrack.jobs.calibration_points import run
    from vidtrack.workflow.job import Job

    folder = ONE_DOT / "calibration"
    outputs = {name: str(tmp_path / name) for name in ("sightings", "picture", "background", "record")}
    tags = [str(k) for k in range(1, 106)]
    run(
        Job(
            {
                "units": "mm",
                "camera": camera,
                "sigma": 0.0,
                "picks_clips": ["target"],
                "clips": {"target": {"tags": tags}},
            },
            {
                "points": str(folder / "points.csv"),
                "videos": [str(folder / f"target/{camera}.tif")],
                "picks": [str(folder / "target/picks.csv")],
            },
            outputs,
        )
    )
    table = pd.read_parquet(outputs["sightings"])
    assert table["found"].sum() == 105
    # an outside witness of the names: a direct linear transformation, which is 0.73 to 0.81 px here by itself and
    # which a single exchange of neighbours would take beyond 3 px
    p, b = table[["x", "y", "z"]].to_numpy(), table[["Xf", "Yf"]].to_numpy()
    p = np.c_[(p - p.mean(0)) / 10, np.ones(105)]
    u = (b - b.mean(0)) / 300
    rows = np.r_[np.c_[p, 0 * p, -u[:, :1] * p], np.c_[0 * p, p, -u[:, 1:] * p]]
    P = np.linalg.svd(rows)[2][-1].reshape(3, 4)
    h = p @ P.T
    rms = np.sqrt((((h[:, :2] / h[:, 2:] - u) * 300) ** 2).sum(1).mean())
    assert 0.5 < rms < 1.2


@pytest.mark.skipif(not ONE_DOT.exists(), reason="the real inputs are not here")
def test_clips_from_after_the_test_are_named_by_those_from_before(tmp_path):
    from vidtrack.jobs.calibration_points import run
    from vidtrack.workflow.job import Job

    folder = ONE_DOT / "calibration"
    clip = {"target": {"tags": [str(k) for k in range(1, 106)]}}
    settings = {"units": "mm", "camera": "cam2", "sigma": 0.0, "picks_clips": ["target"], "clips": clip}
    inputs = {"points": str(folder / "points.csv"), "videos": [str(folder / "target/cam2.tif")]}
    first = {name: str(tmp_path / name) for name in ("sightings", "picture", "background", "record")}
    later = {name: f"{path}_after" for name, path in first.items()}
    run(Job(settings, inputs | {"picks": [str(folder / "target/picks.csv")]}, first))
    run(Job(settings | {"picks_clips": []}, inputs | {"before": first["sightings"]}, later))
    pd.testing.assert_frame_equal(pd.read_parquet(first["sightings"]), pd.read_parquet(later["sightings"]))


def test_a_point_that_is_no_ball_is_placed_by_hand_and_keeps_its_sd():
    k = TAGS.index("5")
    own = picks(*FOUR).assign(sd=np.nan)
    placed = pd.DataFrame(
        {"clip": ["row1"], "tag": ["5"], "Xf": [B[k, 0] + 0.3], "Yf": [B[k, 1] - 0.2], "sd": 0.4, "line": 9}
    )
    shown = clips({"row1": np.delete(B[:12], k, 0)})
    table = calibration_points(
        shown, POINTS, pd.concat([own, placed], ignore_index=True), camera="cam1", tags=SHOWN
    ).table.set_index("tag")
    assert table.loc["5", "found"]
    assert table.loc["5", ["Xf", "Yf"]].tolist() == pytest.approx([B[k, 0] + 0.3, B[k, 1] - 0.2])
    assert table.loc["5", ["sd_x", "sd_y"]].tolist() == [0.4, 0.4]
    assert table.loc["5", "pixels"] == 0
    assert table["found"].all()


def test_a_clip_whose_picture_is_mirrored_is_named_and_gives_no_points():
    flipped = {c: [F(f.luma[:, ::-1].copy()) if c == "row2" else f for f in own] for c, own in clips().items()}
    found = calibration_points(flipped, POINTS, picks(*FOUR), camera="cam1", tags=SHOWN)
    (finding,) = found.findings
    assert (finding.level, finding.code) == ("doubtful", "clip-flipped")
    assert finding.text.startswith("calibration/row2: the picture of camera cam1 is mirrored left to right")
    assert found.table.groupby("clip")["found"].sum().to_dict() == {"row1": 12, "row2": 0, "row3": 12}
