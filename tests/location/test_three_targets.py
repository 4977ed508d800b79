"""Three targets, three cameras: one blind for a second, one late by 0.37 frame, one target never followed in one."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate

RATE, N = 30.0, 240
BLIND, LATE = slice(100, 130), 0.37
NAMES = ["t1", "t2", "t3"]


def course(t):
    """Places (3, n, 3), in, of three targets that ride on waves of 0.4 to 1.1 Hz."""
    hz = np.array([0.4, 0.7, 1.1])[:, None, None]
    middle = np.array([[-14.0, -3, 0], [2, 4, 2], [15, -2, -2]])[:, None]
    reach = np.array([[5.0, 3, 3], [4, 4, 2], [3, 4, 3]])[:, None]
    phase = np.array([[0.0, 1, 2], [3, 1, 0], [2, 4, 1]])[:, None]
    return middle + reach * np.sin(2 * np.pi * hz * t[:, None] + phase)


def recorded():
    """Centroid tables; the second camera's names are permuted after the blind second."""
    rng = np.random.default_rng(3)
    cameras, tables = {}, {}
    t = np.arange(N) / RATE
    for i, camera in enumerate(thesis_rig(3)):
        b = project(camera, course(t + (LATE / RATE if i == 2 else 0.0)))
        b += rng.normal(0, 0.05, b.shape)
        flag = np.full(b.shape[:2], "", object)
        if i == 1:
            b[:, BLIND], flag[:, BLIND] = np.nan, "lost;predicted"
            b[:, BLIND.stop :] = b[[1, 2, 0], BLIND.stop :]
            flag[:, BLIND.stop] = "recovered"
        if i == 0:
            b[2], flag[2] = np.nan, "lost"  # never found there
        rows = {
            "time_s": np.tile(t, 3),
            "target": np.repeat(NAMES, N),
            "flag": flag.ravel(),
            "sd_x": 0.05,
            "sd_y": 0.05,
        }
        tables[f"cam{i + 1}"] = pd.DataFrame(rows | {"Xf": b[..., 0].ravel(), "Yf": b[..., 1].ravel()})
        cameras[f"cam{i + 1}"] = (camera, None)
    return tables, cameras


@pytest.fixture(scope="module")
def found():
    tables, cameras = recorded()
    return locate(tables, cameras, targets=3, clocks={"cam3": "motion"})


def test_all_three_are_located_wherever_two_cameras_saw_them(found):
    table = found.trajectories
    assert set(table["target"]) == set(NAMES)
    for name, own in table.groupby("target"):
        t = own["time_s"].to_numpy()
        fix = own[["x", "y", "z"]].to_numpy()
        off = np.linalg.norm(fix - course(t), axis=-1)  # (3, n)
        true = int(np.argmin(np.nanmedian(off, axis=1)))
        assert np.nanmax(off[true]) < 0.2
        blind = (t > (BLIND.start - 1) / RATE) & (t < (BLIND.stop + 0.5) / RATE)
        inner = (t > 0.05) & (t < t.max() - 0.05)
        seen = inner & ~blind if true == 2 else inner  # the third is seen by the two other cameras alone
        assert np.isfinite(fix[seen]).all(), name
        if true < 2:
            assert name == NAMES[true]
            assert (own["n_cameras"].to_numpy()[inner & ~blind] == 3).all()


def test_the_late_camera_s_clock_is_found(found):
    clock = found.record["clocks"]["cameras"]["cam3"]
    assert clock["offset_s"] == pytest.approx(LATE / RATE, abs=0.002)
