"""Balls that touch in one view are followed through the touch; what cannot be separated is flagged."""

from fractions import Fraction

import numpy as np
import pandas as pd
import pytest

from tests.discs import picture
from tests.tracking.recovery.test_newcomers import along_a_rope
from tests.tracking.test_tracker import DETECTION, starts_at
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.detection.background_picture import background_of
from vidtrack.tracking.detection.static_clutter import static_clutter
from vidtrack.tracking.state import present
from vidtrack.tracking.tracker import Tracker

RATE = Fraction(30)
SHAPE = (140, 200)


def recorded(path, *, radius=5.0, noise=3.0, clutter=None, level=150.0):
    rng = np.random.default_rng(0)
    ground = np.full(SHAPE, 30.0)
    frames = []
    sizes = np.broadcast_to(radius, len(path))
    for i, at in enumerate(path):
        image = picture(SHAPE, [(*p, sizes[i]) for p in at], level=ground, contrast=1.0, dtype=float)
        share = np.clip(image - ground, 0, 1)  # opaque: where two overlap there is one's light
        image = ground + 160 * share
        if clutter is not None:
            image = np.where(clutter, level, image)
        luma = np.clip(np.rint(image + rng.normal(0, noise, SHAPE)), 0, 255).astype(np.uint8)
        frames.append(Frame(i, i / RATE, luma, False, None))
    return frames, VideoInfo(SHAPE[1], SHAPE[0], RATE, field_order="progressive")


def results(path, **settings):
    """Errors, sd (samples, targets, 2) px and flags (samples, targets)."""
    names = [f"t{i}" for i in range(path.shape[1])]
    boxes = pd.DataFrame({"target": names, "Xf": path[0, :, 0], "Yf": path[0, :, 1]})
    table = track(*recorded(path, **settings), targets=names, start_boxes=boxes).centroids
    n = len(names)
    place, sd = (table[c].to_numpy().reshape(-1, n, 2) for c in (["Xf", "Yf"], ["sd_x", "sd_y"]))
    return place - path, sd, table["flag"].to_numpy().reshape(-1, n)


def meeting(nearest, n=70):
    """Two balls that swing towards each other, to `nearest` px, and stay near each other for long."""
    t = np.arange(n)
    gap = nearest + 40 * (0.5 + 0.5 * np.cos(2 * np.pi * t / n)) ** 2
    x, y = 100 + 6 * np.sin(t / 7), 70 + 5 * np.cos(t / 9)
    return np.stack([np.stack([x - gap / 2, y - 0.2 * gap / 2], -1), np.stack([x + gap / 2, y + 0.2 * gap / 2], -1)], 1)


@pytest.mark.parametrize("nearest", [10.0, 8.0, 6.0])
def test_balls_that_touch_for_long_are_measured_all_the_time(nearest):
    """Radius 5 px: at 6 px they overlap by 40 % of a diameter."""
    error, sd, flag = results(meeting(nearest))
    seen = np.isfinite(error[..., 0])
    assert seen.mean() > 0.98
    assert np.nanmax(np.abs(error)) < 0.15
    assert np.nanmax(np.abs(error / sd)) < 5
    assert (flag[seen] == "").mean() > 0.97


def test_balls_that_came_nearer_since_they_touched_are_measured_when_they_touch_again():
    """They grow by a fifth while they are apart, which is not what the fit of the first touch knows."""
    t = np.arange(90)
    radius = np.interp(t, [30, 60], [10.0, 12.0])
    half = radius * (1.15 + 0.35 * np.cos(2 * np.pi * (t - 45) / 60))
    middle = np.stack([100 + 4 * np.sin(t / 9), 70 + 5 * np.cos(t / 11)], axis=-1)
    apart = np.stack([half, 0.2 * half], axis=-1)
    error, sd, _ = results(np.stack([middle - apart, middle + apart], axis=1), radius=radius)
    again = t > 60
    assert (half < 0.95 * radius)[again].sum() > 15
    assert np.isfinite(error[again]).all()
    assert np.nanmax(np.abs(error / sd)) < 5


def test_balls_of_which_one_hides_the_other_are_flagged_and_their_blob_is_not_taken_for_both():
    error, sd, flag = results(meeting(1.0))
    hidden = np.isnan(error[..., 0])
    assert hidden.any()
    assert all("merged" in word or "lost" in word for word in flag[hidden])
    before = np.flatnonzero(hidden.any(axis=1))[0]
    assert np.nanmax(np.abs(error / sd)[:before]) < 6
    assert (~hidden).sum(axis=1)[before : np.flatnonzero(hidden.any(axis=1))[-1]].max() < 2, "one blob is one target"


@pytest.mark.parametrize("period", [40, 50])
def test_two_that_hid_each_other_are_measured_where_their_blob_shows_two_again(period):
    """Their courses turn while they are hidden, and lead past where they are."""
    t = np.arange(70)
    middle = np.stack([100 + 4 * np.sin(t / 9), 70 + 5 * np.cos(t / 9)], axis=-1)
    gap = 6.5 * np.cos(2 * np.pi * (t - 8) / period) + 25 * np.exp(-t / 3)
    half = np.stack([gap, 1.5 + 1.5 * np.sin(2 * np.pi * t / 25)], axis=-1) / 2
    error, sd, _ = results(np.stack([middle - half, middle + half], axis=1))
    seen = np.isfinite(error[..., 0]).all(axis=1)
    assert seen[2 * np.hypot(*half.T) > 4.5].mean() > 0.95
    assert not seen[2 * np.hypot(*half.T) < 3].any()
    assert np.nanmax(np.abs(error / sd)) < 5


def test_a_ball_behind_a_still_rope_is_measured_by_what_is_to_be_seen_of_it():
    t = np.arange(60)
    path = np.stack([60 + 1.3 * t, 70 + 10 * np.sin(t / 8)], axis=-1)[:, None]
    rope = np.zeros(SHAPE, bool)
    rope[:, 98:101] = True
    error, sd, flag = results(path, radius=6.0, clutter=rope)
    seen = np.isfinite(error[..., 0])
    assert seen.mean() > 0.93
    assert np.nanmax(np.abs(error / sd)) < 5
    assert all("merged" in word for word in flag[~seen])


def test_a_ball_that_a_dark_rope_cuts_in_two_is_measured_within_its_sd():
    t = np.arange(40)
    path = np.stack([60 + 1.6 * t, 70 + 6 * np.sin(t / 8)], axis=-1)[:, None]
    rope = np.zeros(SHAPE, bool)
    rope[:, 104:110] = True
    error, sd, _ = results(path, radius=9.0, clutter=rope, level=5.0)
    assert np.isfinite(error).all()
    assert np.abs(error / sd).max() < 5
    assert np.median(np.abs(error[25:32])) < 0.05


def test_two_that_touch_behind_a_dark_rope_are_measured_by_what_it_leaves_of_them():
    t = np.arange(50)
    middle = np.stack([50 + 1.6 * t, 70 + 6 * np.sin(t / 8)], axis=-1)
    apart = np.stack([np.zeros(50), 11 - 2.5 * np.sin(np.pi * t / 50)], axis=-1)  # they touch from sample 6 to 43
    rope = np.zeros(SHAPE, bool)
    rope[:, 90:95] = True
    error, sd, _ = results(np.stack([middle - apart, middle + apart], axis=1), radius=9.0, clutter=rope, level=5.0)
    seen = np.isfinite(error[..., 0])
    assert seen.mean() > 0.9
    assert np.nanmax(np.abs(error / sd)) < 5


def test_a_target_that_motion_alone_has_shown_is_measured_beside_clutter():
    """What a trail of the opening has shown holds no background."""
    samples, place = along_a_rope(np.full((34, 1, 2), np.nan))
    clutter = static_clutter(samples, background_of(samples[:10], DETECTION), DETECTION, np.zeros((0, 4)))
    starts = starts_at(place[10:11])._replace(
        velocity=np.array([[0.0, -7.0]]),
        acceleration=np.zeros((1, 2)),
        pixels=np.array([48.0]),
        contrast=np.array([175.0]),
        size=np.full((1, 2), 8.0),
    )
    tracker = Tracker(starts, DETECTION, 100.0, static=clutter)
    tracker.follow([sample._replace(time=float(k)) for k, sample in enumerate(samples[10:])])
    tracker.finish()
    rows = tracker.rows()
    assert present(rows).all()
    assert np.abs(rows.values[:2, :, 0].T - place[10:]).max() < 0.3
