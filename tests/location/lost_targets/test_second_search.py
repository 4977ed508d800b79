"""What a camera lost or could not separate is measured where the other cameras show it, and nothing else is."""

import numpy as np
import pandas as pd
import pytest
from scipy.ndimage import gaussian_filter

from vidtrack.geometry.ball_perspective import outline_offset
from vidtrack.geometry.camera import project
from vidtrack.location.lost_targets import second_search
from vidtrack.location.lost_targets.second_search import SOUGHT, searched_again
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate
from vidtrack.tracking.windows import COLUMNS

N, RADIUS, NOISE, CONTRAST = 90, 5.0, 2.0, 150.0
GAP = slice(40, 50)
T = np.arange(N) / 30


def courses(cameras, apart, seed=0):
    """Two balls (2, N, 3), in, that swing; for the first camera one passes the other at so many radii in the gap."""
    rng = np.random.default_rng(seed)
    t = T[:, None]
    one = np.array([2.0, -3.0, 1.0]) + np.sin(2 * np.pi * (0.7 * t + rng.uniform(0, 1, 3))) * (4, 3, 2)
    camera = cameras[0]
    ahead = camera.position - one
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    across = np.cross(ahead, [0, 0, 1.0])
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    up = np.cross(across, ahead)
    px = np.linalg.norm(project(camera, one + 0.01 * across) - project(camera, one), axis=-1, keepdims=True) / 0.01
    middle = (GAP.start + GAP.stop) / 2 / 30
    off = (apart * RADIUS * up + 60.0 * (t - middle) * across) / px
    return np.stack([one, one + off + 12 * ahead])


def grey(places, rng, covered=False, shape=(70, 70)):
    """A piece of a picture of balls that cover each other, their middles at these columns and rows (..., m, 2): the
    mean over the stations of an exposure on the leading axes.
    """
    fine = 5
    y, x = (np.mgrid[: shape[0] * fine, : shape[1] * fine] + 0.5) / fine - 0.5
    light = np.zeros(y.shape)
    stations = np.reshape(places, (-1, *np.shape(places)[-2:]))
    for at in stations if not covered else ():
        lit = np.zeros(y.shape, bool)
        for u, v in at:
            lit |= (x - u) ** 2 + (y - v) ** 2 < RADIUS**2
        light += lit / len(stations)
    share = light.reshape(shape[0], fine, shape[1], fine).mean(axis=(1, 3))
    image = 40 + CONTRAST * gaussian_filter(share, 0.6) + rng.normal(0, NOISE, shape)
    return np.clip(np.rint(image), 1, 255).astype(np.uint8)


def recorded(cameras, p, rng, covered=False, exposure=0.0, sized=False):
    """Tables of centroids, of tracklets and of pieces, as the track stage writes them; the first camera has a gap.

    exposure  samples, over which what is in the pieces is drawn out
    sized     the middles of outlines are seen, as balls have them, and tables say how large balls look
    """
    centroids, tracklets, kept = {}, {}, {}
    for i, camera in enumerate(cameras):
        b = project(camera, p)
        b = b + outline_offset(camera, b, RADIUS * sized)
        seen = b + rng.normal(0, 0.05, b.shape)
        flag = np.full((2, N), "", object)
        if i == 0:
            seen[:, GAP], flag[:, GAP] = np.nan, "predicted;merged"
        rows = {
            "frame": np.tile(np.arange(N), 2),
            "field": "frame",
            "time_s": np.tile(T, 2),
            "target": np.repeat(["t1", "t2"], N),
            "Xf": seen[..., 0].ravel(),
            "Yf": seen[..., 1].ravel(),
            "sd_x": 0.05,
            "sd_y": 0.05,
            "flag": flag.ravel(),
        } | ({"pixels": np.pi * RADIUS**2} if sized else {})
        table = centroids[f"cam{i + 1}"] = pd.DataFrame(rows)
        number = np.repeat([0, 2], N) + (np.tile(np.arange(N), 2) >= GAP.stop) * (i == 0)
        drawn = exposure * float(np.nanmedian(np.linalg.norm(np.diff(seen, axis=1), axis=-1)))
        pixels = np.pi * RADIUS**2 + 1.5 * RADIUS * drawn
        own = table.assign(tracklet=number, pixels=pixels, brightness=CONTRAST * np.pi * RADIUS**2 / pixels)
        tracklets[f"cam{i + 1}"] = own.assign(began="found", ended="lost", met="", bound=False).dropna(subset="Xf")
        pieces = []
        for k in range(GAP.start, GAP.stop) if i == 0 else ():
            corner = np.floor(b[:, k].mean(0)).astype(int) - 35
            tau = (exposure * ((np.arange(16) + 0.5) / 16 - 0.5) if exposure else np.zeros(1))[:, None, None]
            way, bend = (b[:, k + 1] - b[:, k - 1]) / 2, b[:, k + 1] - 2 * b[:, k] + b[:, k - 1]
            picture = grey(b[:, k] + tau * way + tau**2 / 2 * bend - corner, rng, covered)
            pieces.append(
                (k, "frame", T[k], *corner, 0, 1, 70, picture.tobytes(), NOISE, 1.0, 1.0, exposure, 0.0, 0.0, 0.0)
            )
        kept[f"cam{i + 1}"] = pd.DataFrame(pieces, columns=list(COLUMNS))
    return centroids, tracklets, kept


def found(n_cameras, apart, *, seed=0, covered=False, sought=True, exposure=0.0, sized=False):
    cameras = thesis_rig(n_cameras)
    p = courses(cameras, apart, seed)
    centroids, tracklets, kept = recorded(cameras, p, np.random.default_rng(seed), covered, exposure, sized)
    known = {f"cam{i + 1}": (camera, None) for i, camera in enumerate(cameras)}
    done = locate(centroids, known, targets=2, tracklets=tracklets, kept=kept if sought else None)
    table = done.trajectories
    error = np.full((2, N, 3), np.nan)
    for own in table["target"].unique():
        fix = table.loc[table["target"] == own, ["x", "y", "z"]].to_numpy()
        off = [np.nanmedian(np.linalg.norm(fix - true, axis=-1)) for true in p]
        error[["t1", "t2"].index(own)] = fix - p[int(np.argmin(off))]
    return done, error


@pytest.mark.parametrize("n_cameras", [2, 3])
def test_two_balls_that_touch_in_one_view_are_measured_where_the_other_cameras_show_them(n_cameras):
    before, _ = found(n_cameras, 1.4, sought=False)
    after, error = found(n_cameras, 1.4)
    assert after.record["samples"]["sought_again"]["cam1"] >= 16  # of 20
    own = after.record["samples"]["in_view"]["cam1"].values()  # what was sought is not what the track shows
    assert sum(target["sought"] for target in own) == after.record["samples"]["sought_again"]["cam1"]
    assert all(target["tracked"] + target["sought"] <= target["inside"] for target in own)
    assert after.trajectories["n_cameras"].sum() >= before.trajectories["n_cameras"].sum() + 16
    assert np.isfinite(error[..., 0]).sum() >= np.isfinite(before.trajectories["x"]).sum() + 16 * (n_cameras == 2)
    sought = after.trajectories["flag"].str.contains(SOUGHT)
    assert sought.sum() >= 16
    assert not after.trajectories.loc[sought, "flag"].str.contains("merged").any()


def test_their_sd_is_right():
    z = []
    for seed in range(2):
        for apart in (1.0, 1.7):
            done, error = found(2, apart, seed=seed)
            table = done.trajectories
            sigma = table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy().reshape(2, N, 3)
            z.append((error / sigma)[table["flag"].str.contains(SOUGHT).to_numpy().reshape(2, N)])
    z = np.concatenate(z)
    assert len(z) > 60
    assert 0.8 < np.sqrt(np.mean(z**2)) < 1.25
    assert np.abs(z).max() < 5


def test_what_a_long_exposure_draws_out_is_put_to_the_middle_of_the_exposure():
    """The exposure is longer than any, so that what it does is plain beside the noise."""
    rms = []
    for exposure in (0.0, 3.0):
        done, error = found(2, 1.7, exposure=exposure)
        own = done.trajectories["flag"].str.contains(SOUGHT).to_numpy().reshape(2, N)
        assert own.sum() >= 16
        rms.append(float(np.sqrt(np.nanmean(error[own] ** 2))))
    assert rms[1] < 1.5 * rms[0]


def test_balls_are_sought_where_their_outlines_are_and_located_where_their_middles_are(monkeypatch):
    """As if the perspective were sixty times what it is."""
    single = outline_offset

    def sixtyfold(*args):
        return 60 * single(*args)

    monkeypatch.setattr("vidtrack.location.cameras.ball_middles.outline_offset", sixtyfold)
    monkeypatch.setattr("tests.location.lost_targets.test_second_search.outline_offset", sixtyfold)
    monkeypatch.setattr("vidtrack.location.cameras.ball_middles.SHARE", 0.0)
    monkeypatch.setattr("tests.location.lost_targets.test_second_search.RADIUS", 12.0)
    done, error = found(2, 1.7, sized=True)
    table = done.trajectories
    own = table["flag"].str.contains(SOUGHT).to_numpy().reshape(2, N)
    sigma = table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy().reshape(2, N, 3)
    assert own.sum() >= 16  # of 20
    assert np.sqrt(np.mean((error / sigma)[own] ** 2)) < 1.25


def test_the_sd_of_what_is_sought_holds_how_well_the_perspective_of_balls_is_known(monkeypatch):
    own, sd = second_search.second_search, []

    def watched(*args):
        out = own(*args)
        sd[-1].extend(np.concatenate([one.sd for one in out]).max(axis=1))
        return out

    monkeypatch.setattr(second_search, "second_search", watched)
    monkeypatch.setattr("tests.location.lost_targets.test_second_search.RADIUS", 12.0)
    for share in (0.0, 3.0):
        monkeypatch.setattr("vidtrack.location.cameras.ball_middles.SHARE", share)
        sd.append([])
        found(2, 1.7, sized=True)
    assert np.median(sd[1]) > 1.5 * np.median(sd[0])


@pytest.mark.parametrize("n_cameras", [2, 3])
def test_where_nothing_is_to_be_seen_nothing_is_found(n_cameras):
    done, _ = found(n_cameras, 1.4, covered=True)
    assert done.record["samples"]["sought_again"]["cam1"] == 0
    same, _ = found(n_cameras, 1.4, covered=True, sought=False)
    pd.testing.assert_frame_equal(done.trajectories, same.trajectories)


def test_over_a_long_gap_the_one_camera_that_sees_them_shows_where_they_are(monkeypatch):
    """25 samples are more than places alone are interpolated over."""
    monkeypatch.setattr("tests.location.lost_targets.test_second_search.GAP", slice(32, 57))
    done, error = found(2, 1.7)
    table = done.trajectories
    own = table["flag"].str.contains(SOUGHT).to_numpy().reshape(2, N)
    assert own.sum() >= 40  # of 50
    sigma = table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy().reshape(2, N, 3)
    assert np.abs(error / sigma)[own].max() < 5


def test_balls_nearly_behind_each_other_are_left_alone():
    done, _ = found(3, 0.3)
    sought = done.trajectories["flag"].str.contains(SOUGHT)
    gap = done.trajectories["time_s"].between(T[GAP.start + 4], T[GAP.stop - 5])
    assert not (sought & gap).any()


@pytest.mark.parametrize(("later", "least", "most"), [(-86400.0, 16, 20), (0.01, 0, 0)])
def test_pieces_are_of_the_sample_of_their_time_also_past_midnight(later, least, most):
    cameras = thesis_rig(3)
    centroids, tracklets, kept = recorded(cameras, courses(cameras, 1.4), np.random.default_rng(0))
    kept = {name: table.assign(time_s=table["time_s"] + later) for name, table in kept.items()}
    known = {f"cam{i + 1}": (camera, None) for i, camera in enumerate(cameras)}
    done = locate(centroids, known, targets=2, tracklets=tracklets, kept=kept)
    assert least <= done.record["samples"]["sought_again"]["cam1"] <= most


def test_where_no_camera_kept_a_piece_nothing_is_computed():
    class View:
        name = "cam1"

    table = pd.DataFrame({name: [] for name in COLUMNS})
    pieces = {"cam1": {name: table[name].to_numpy() for name in table}}
    match = object()
    assert searched_again([View], [np.arange(3.0)], np.arange(3.0), match, pieces, {})[1:] == (match, {"cam1": 0})
