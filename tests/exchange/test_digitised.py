"""Where each camera saw each target, row by row, from the tables of a run."""

import numpy as np
import pandas as pd
import pytest

from tests.exchange.runs import RATE, START, camera
from vidtrack.errors import VidtrackError
from vidtrack.exchange.digitised import coefficients, digitised
from vidtrack.exchange.measured import Run
from vidtrack.geometry.camera import project

CAMERAS = {name: camera(name, pan) for name, pan in (("cam1", -40.0), ("cam2", 20.0), ("cam3", 80.0))}
AHEAD = {"cam1": 0, "cam2": 3, "cam3": -2}
"""Frames by which each camera's count is ahead of cam1's at one moment."""
NAMES = ("bow", "stern")


def paths(n=40):
    t = np.arange(n) / RATE
    return np.stack(
        [np.stack([10 * np.sin(6 * t + k), 5 * np.cos(4 * t), 3 * np.sin(5 * t) + k], -1) for k in range(len(NAMES))],
        1,
    )


def digitised_run(n=40, late=0.0, fields=False, clocks=None):
    """Each target is tracked under the other's name in cam2: associations.parquet says which tracklet is whose."""
    p = paths(n)
    at = START + np.arange(n) / RATE
    rows = [
        pd.DataFrame(
            {"time_s": at, "target": name, **dict(zip("xyz", p[:, k].T, strict=True)), "miss": 0.001, "flag": ""}
        )
        for k, name in enumerate(NAMES)
    ]
    centroids, tracklets, associations = {}, {}, []
    for name, own in CAMERAS.items():
        frame = np.arange(n) + AHEAD[name]
        keep = frame >= 0
        time = at + (late if name == "cam3" else 0.0) - (clocks or {}).get(name, 0.0)
        px = project(own, p)
        here, pieces = [], []
        for k in range(2):
            called = NAMES[1 - k] if name == "cam2" else NAMES[k]
            one = {"frame": frame[keep], "field": "top" if fields else "frame", "time_s": time[keep]}
            one = pd.DataFrame(one | {"Xf": px[keep, k, 0], "Yf": px[keep, k, 1]})
            if fields:
                second = one.assign(field="bottom", time_s=one["time_s"] + 0.5 / RATE, Xf=-9.0)
                one = pd.concat([one, second]).sort_values("time_s")
            here.append(one.assign(target=called))
            pieces.append(one.assign(tracklet=k + 1))
            associations.append(
                {"camera": name, "tracklet": k + 1, "track": called, "target": NAMES[k], "start_s": 0.0, "end_s": 1e6}
            )
        centroids[name], tracklets[name] = pd.concat(here, ignore_index=True), pd.concat(pieces, ignore_index=True)
    tables = {"trajectories": pd.concat(rows, ignore_index=True), "associations": pd.DataFrame(associations)}
    offsets = {name: {"offset_s": s, "rate_ppm": 0.0} for name, s in (clocks or {}).items()}
    return Run("pluck", "in", tables, centroids, CAMERAS, offsets, tracklets=tracklets)


def test_a_row_is_one_moment_in_every_camera():
    own = digitised(digitised_run())
    assert own.names == NAMES
    assert own.offsets.tolist() == [0, 3, -2]
    for c, name in enumerate(CAMERAS):
        first = 2 if name == "cam3" else 0
        np.testing.assert_allclose(own.b[first:, :, c], project(CAMERAS[name], paths())[first:], rtol=1e-12)
    assert np.isnan(own.b[:2, :, 2]).all()
    np.testing.assert_allclose(own.xyz, paths(), rtol=1e-12)


def test_positions_without_the_lens_are_those_of_a_pinhole():
    own = digitised(digitised_run())
    for c, name in enumerate(CAMERAS):
        expected = project(CAMERAS[name].without_lens(), paths())
        seen = np.isfinite(own.b[:, :, c])
        np.testing.assert_allclose(own.flat[:, :, c][seen], expected[seen], atol=1e-9)
    assert any("its lens moves the points by up to" in note for note in own.notes)


def test_clocks_are_those_that_located_the_targets():
    own = digitised(digitised_run(clocks={"cam2": 0.123, "cam3": -0.05}))
    assert own.offsets.tolist() == [0, 3, -2]
    assert not any("of a frame" in note for note in own.notes)


def test_a_camera_between_frames_is_said_and_not_interpolated():
    own = digitised(digitised_run(late=0.3 / RATE))
    assert any(note.startswith("cam3: its frames lie up to 0.3 of a frame") for note in own.notes)
    np.testing.assert_allclose(own.b[2:, :, 2], project(CAMERAS["cam3"], paths())[2:], rtol=1e-12)


def test_of_an_interlaced_frame_the_first_field_is_taken():
    own = digitised(digitised_run(fields=True))
    np.testing.assert_allclose(own.b[:, :, 0], project(CAMERAS["cam1"], paths()), rtol=1e-12)


def test_coefficients_project_as_the_pinhole_does():
    own = CAMERAS["cam1"].without_lens()
    L = coefficients(own, np.eye(3))
    p = paths()[:, 0]
    w = p @ L[8:11] + 1
    np.testing.assert_allclose(np.stack([p @ L[:3] + L[3], p @ L[4:7] + L[7]], -1) / w[:, None], project(own, p))


def test_an_origin_beside_the_camera_is_refused():
    with pytest.raises(VidtrackError, match="origin lies beside it"):
        coefficients(camera(T=np.array([100.0, 3.0, 0.0])), np.eye(3))
