"""Circumstances that recordings come with: each target is measured right, or it is said why not."""

from fractions import Fraction

import cv2
import numpy as np
import pandas as pd
import pytest

from tests.discs import disc, picture
from vidtrack.stages.track import track
from vidtrack.timing.frame import Coded, Frame, VideoInfo

RATE = Fraction(30)
SHAPE = (200, 260)


def circle(k=60, n=1, *, radius=55.0, period=60.0):
    t = 2 * np.pi * (np.arange(k)[:, None] / period + np.arange(n) / n)
    return np.stack([130 + radius * np.cos(t), 100 + radius * np.sin(t)], axis=-1)


def recorded(path, *, radius=5.0, contrast=150.0, noise=3.0, shape=SHAPE, level=30.0):
    rng = np.random.default_rng(0)
    frames = [
        Frame(
            i,
            i / RATE,
            picture(shape, [(*p, radius) for p in at], level=level, contrast=contrast, noise=noise, rng=rng),
            False,
            None,
        )
        for i, at in enumerate(path)
    ]
    return frames, VideoInfo(shape[1], shape[0], RATE, field_order="progressive")


def boxes(*rows):
    return pd.DataFrame(rows, columns=["target", "Xf", "Yf"])


def off(tracked, path):
    """px from the nearest ball, (samples, targets), NaN where not measured."""
    n = tracked.centroids["target"].nunique()
    at = tracked.centroids[["Xf", "Yf"]].to_numpy().reshape(-1, n, 2)
    return np.linalg.norm(at[:, :, None] - path[:, None], axis=-1).min(axis=-1)


def codes(tracked):
    return [finding.code for finding in tracked.findings]


@pytest.mark.parametrize("contrast", [16, 20, 24, 28])
def test_dim_targets_in_noise_are_found_whole_and_not_by_their_crumbs(contrast):
    path = circle()
    tracked = track(*recorded(path, radius=4.0, contrast=contrast))
    assert np.isfinite(off(tracked, path)).mean() > 0.98
    assert np.nanmax(off(tracked, path)) < 0.6
    assert tracked.centroids["pixels"].median() > 30


@pytest.mark.parametrize("settings", [{}, {"threshold": 150}])
def test_a_still_grain_of_the_scene_does_not_hide_a_bright_target(settings):
    grain = np.clip(60 + np.random.default_rng(5).normal(0, 18, SHAPE), 0, 255)
    path = circle()
    tracked = track(*recorded(path, contrast=160, noise=2.0, level=grain), **settings)
    assert np.isfinite(off(tracked, path)).all()
    assert np.nanmax(off(tracked, path)) < 0.5


@pytest.mark.parametrize("speed", [6, 20, 40])
def test_a_start_box_never_makes_it_worse(speed):
    x = np.arange(20, 440, speed, dtype=float)
    path = np.stack([x, np.full(x.size, 60.0)], axis=-1)[:, None]
    frames, info = recorded(path, shape=(120, 460))
    tracked = track(frames, info, start_boxes=boxes(["a", *path[0, 0]]))
    assert np.isfinite(off(tracked, path)).all()
    assert np.nanmax(off(tracked, path)) < 0.1


@pytest.mark.parametrize("beside", [(0.0, 0.0), (10.0, -9.0)], ids=["on it", "beside it"])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_start_box_before_a_patterned_wall_takes_the_ball_and_not_the_pattern(seed, beside):
    rng = np.random.default_rng(seed)
    pattern = cv2.GaussianBlur(rng.normal(0, 1, SHAPE), (0, 0), 2.0)
    wall = np.clip(30 + 22 * pattern / pattern.std(), 0, 255)
    path = circle(n=2)
    named = boxes(["a", *path[0, 0] + beside], ["b", *path[0, 1] + beside])
    for contrast in (170, -1):
        level = wall if contrast > 0 else 255 - wall
        polarity = "bright" if contrast > 0 else "dark"
        tracked = track(
            *recorded(path, contrast=170.0 * np.sign(contrast), level=level), start_boxes=named, polarity=polarity
        )
        first = tracked.centroids.iloc[:2][["Xf", "Yf"]].to_numpy()
        assert np.abs(first - path[0]).max() < 1
        assert np.isfinite(off(tracked, path)).mean() > 0.9
        assert np.nanmax(off(tracked, path)) < 1.5


def test_faint_smears_beside_the_course_of_a_bright_target_do_not_count_as_clutter():
    rng, (y, x) = np.random.default_rng(3), np.mgrid[: SHAPE[0], : SHAPE[1]]
    level = np.full(SHAPE, 30.0)
    for _ in range(12):
        at = rng.uniform(20, [SHAPE[1] - 20, SHAPE[0] - 20])
        level = np.maximum(level, 30 + 13 * np.exp(-((((x - at[0]) / 14) ** 2 + ((y - at[1]) / 5) ** 2) ** 2)))
    path = circle()
    tracked = track(*recorded(path, contrast=170, noise=2.0, level=level))
    sd = tracked.centroids["sd_x"].to_numpy()
    assert np.isfinite(off(tracked, path)).all()
    assert (off(tracked, path)[:, 0] < 5 * sd).all()


def test_a_picture_that_repeats_measures_no_moving_target_and_says_so():
    path = circle(period=45.0)
    frames, info = recorded(path)
    repeats = [13, 30, 31, 59]
    for i in repeats:
        frames[i] = frames[i]._replace(luma=frames[i - 1].luma.copy())
    tracked = track(frames, info)
    table = tracked.centroids
    assert table.loc[table["Xf"].isna(), "frame"].tolist() == repeats
    assert table.loc[repeats, "flag"].str.contains("repeated").all()
    assert np.nanmax(off(tracked, path)) < 0.1
    assert "pictures-repeat" in codes(tracked)
    assert not set(tracked.tracklets["frame"]) & set(repeats)


def test_a_target_at_rest_is_measured_in_pictures_that_repeat_as_well():
    path = np.tile([[[130.3, 100.4]]], (30, 1, 1))
    frames, info = recorded(path)
    frames = [frames[0]._replace(index=i, time=i / RATE) for i in range(30)]
    tracked = track(frames, info)
    assert (tracked.centroids["flag"] == "").all()
    assert codes(tracked) == []


def never(tracked):
    (finding,) = [finding for finding in tracked.findings if finding.code == "target-never-measured"]
    assert finding.level == "bad"
    assert finding.cure
    return finding.text


def test_a_target_that_is_never_measured_is_told_with_the_likeliest_cause():
    path = circle(radius=30)
    frames, info = recorded(path)
    here, elsewhere = boxes(["a", *path[0, 0]]), boxes(["a", 20.0, 20.0])
    told = never(track(frames, info, start_boxes=elsewhere))
    assert "nothing in its start box stands out" in told
    assert "px away" in told
    assert "the threshold of 220 is not reached" in never(track(frames, info, threshold=220, start_boxes=here))
    assert "stands out of the noise" in never(track(frames, info, polarity="dark", start_boxes=here))
    assert "1 of 3 targets" in never(track(frames, info, targets=3))


def test_more_things_than_targets_are_followed_and_told():
    path = circle(n=3)
    tracked = track(*recorded(path))
    (finding,) = tracked.findings
    assert finding.code == "more-targets-seen"
    assert "Set targets to 3" in finding.cure
    assert tracked.tracklets["tracklet"].nunique() == 3
    assert (tracked.tracklets["target"] == "").groupby(tracked.tracklets["tracklet"]).first().tolist() == [
        False,
        True,
        True,
    ]


def test_all_targets_are_as_many_as_move():
    frames, info = recorded(circle(n=3))
    tracked = track(frames, info, targets="all")
    assert tracked.centroids["target"].unique().tolist() == ["t1", "t2", "t3"]
    assert tracked.centroids["Xf"].notna().all()
    assert "more-targets-seen" not in [finding.code for finding in tracked.findings]
    one = track(frames, info, targets="all", start_boxes=boxes(("ball", *circle(n=3)[0, 1])))
    assert one.centroids["target"].unique().tolist() == ["ball"]
    assert set(one.tracklets["target"]) == {"ball", ""}


def test_a_start_box_binds_its_name_to_the_tracklet_that_begins_in_it():
    path = circle(n=2)
    frames, info = recorded(path)
    tracked = track(frames, info, start_boxes=boxes(["a", *path[0, 0]], ["b", *path[0, 1]]))
    first = tracked.tracklets.groupby("tracklet").first()
    assert first["target"].tolist() == ["a", "b"]
    assert first["bound"].all()
    assert not track(frames, info, targets=2).tracklets["bound"].any()


def test_targets_that_touch_when_they_begin_and_move_on_at_once_are_found_again():
    t = np.arange(60.0)[:, None]
    one = np.concatenate([80 + 55 * np.sin(t / 9), 95 - 0.6 * t], axis=1)
    two = np.concatenate([82 + 60 * np.sin(t / 7), 105 + 0.7 * t], axis=1)
    path = np.stack([one, two], axis=1)
    tracked = track(*recorded(path), targets=2, start_boxes=boxes(["a", *path[0, 0]], ["b", *path[0, 1]]))
    measured = np.isfinite(off(tracked, path))
    assert measured[12:].mean() > 0.95
    assert np.nanmax(off(tracked, path)) < 0.3


def test_nothing_is_measured_in_pictures_whose_damage_the_decoder_does_not_report():
    frames, info = recorded(circle(), noise=1.5)
    grain = np.random.default_rng(1).normal(0, 8, SHAPE)
    rng = np.random.default_rng(2)
    garbage = np.kron(rng.choice([-50, 0, 0, 0, 50], (SHAPE[0] // 8, SHAPE[1] // 8)), np.ones((8, 8)))
    garbage = np.pad(garbage, ((0, 0), (0, SHAPE[1] % 8)))
    hurt = range(30, 37)
    levels = [frame.luma + grain + (garbage if frame.index in hurt else 0) for frame in frames]
    coded = [Coded(f.index, int(f.index >= hurt.stop), f.index in (0, hurt.stop), False) for f in frames]
    frames = [
        f._replace(luma=np.clip(level, 0, 255).astype(np.uint8), coded=order)
        for f, level, order in zip(frames, levels, coded, strict=True)
    ]
    tracked = track(frames, info, targets=1)
    table = tracked.centroids.set_index("frame")
    assert table["Xf"].isna()[list(hurt)].all()
    assert table["flag"][list(hurt)].str.contains("corrupt").all()
    assert table["Xf"].notna().sum() == len(frames) - len(hurt)
    assert not tracked.tracklets["frame"].isin(hurt).any()
    (finding,) = [one for one in tracked.findings if one.code == "damage-seen"]
    assert finding.text.startswith("7 pictures are damaged, though their decoder reports nothing (frame 30 to 36)")


def beginning(kind, *, flagged):
    """A film of two balls over texture whose first pictures show something else; the second ball comes in late."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    texture = 70 + 18 * np.sin(x / 7) * np.cos(y / 9)
    t = np.arange(60)[:, None]
    path = np.stack([np.hstack([40 + 2 * t, 262 - 2 * t]), np.hstack([60 + 12 * np.sin(t / 9), 140 + 0 * t])], axis=-1)
    frames, about = recorded(path, contrast=130, noise=4, level=texture)
    rng = np.random.default_rng(7)
    for k in range(6 if flagged else 10):
        luma = np.full(SHAPE, {"black": 16, "grey": 128}.get(kind, 0), np.uint8)
        if kind == "garbage":
            luma[:] = frames[k].luma
            luma[60:] = np.repeat(rng.integers(90, 110, (1, SHAPE[1])), SHAPE[0] - 60, axis=0)
        frames[k] = frames[k]._replace(luma=luma, corrupt=flagged)
    return frames, about, path


@pytest.mark.parametrize(
    ("kind", "flagged"), [("grey", True), ("garbage", True), ("black", True), ("black", False), ("grey", False)]
)
def test_a_beginning_that_shows_something_else_sets_no_limits(kind, flagged):
    frames, about, path = beginning(kind, flagged=flagged)
    tracked = track(frames, about, targets=2)
    assert tracked.diagnostics["noise"] == pytest.approx(4.0, rel=0.25)
    apart = off(tracked, path)
    plain = (tracked.centroids["flag"] == "").to_numpy().reshape(apart.shape)
    assert np.isfinite(apart[20:]).all()
    assert np.nanmax(apart[plain]) < 1
    if flagged:
        assert (tracked.centroids["flag"].str.contains("corrupt")[: 2 * 6]).all()


@pytest.mark.parametrize(("seed", "stroke"), [(0, 105.0), (1, 85.0), (2, 85.0), (2, 105.0)])
def test_a_stroke_of_the_wall_in_a_start_box_is_not_taken_for_the_ball(seed, stroke):
    rng = np.random.default_rng(seed)
    wall = np.full(SHAPE, 60.0)
    for _ in range(600):
        x, y, turned = rng.integers(SHAPE[1]), rng.integers(SHAPE[0]), rng.random() < 0.5
        long, slim = rng.integers(4, 12), rng.integers(1, 3)
        wall[y : y + (long if turned else slim), x : x + (slim if turned else long)] = stroke
    path = np.array([[60, 50], [190, 60], [70, 140], [180, 150]]) + 0.3 * np.arange(12)[:, None, None] * (1, 0)
    path[:, 0] = path[0, 0]
    frames, info = [], VideoInfo(SHAPE[1], SHAPE[0], RATE, field_order="progressive")
    for i, balls in enumerate(path):
        cover = sum(disc(SHAPE, *ball, 6.0) for ball in balls)
        luma = np.rint(wall + cover * (190 - wall) + rng.normal(0, 1.5, SHAPE)).astype(np.uint8)
        frames.append(Frame(i, i / RATE, luma, False, None))
    begun = boxes(*(["abcd"[k], *path[0, k]] for k in range(4))).assign(width=26.0, height=26.0)
    tracked = track(frames, info, start_boxes=begun)
    at = tracked.centroids[["Xf", "Yf"]].to_numpy().reshape(path.shape)
    assert np.isfinite(at).mean() > 0.7
    assert np.nanmax(np.abs(at - path)) < 0.5
