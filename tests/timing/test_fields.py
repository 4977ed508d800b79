import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.files.clips import NTSC, ball, make_clip
from vidtrack.timing import fields
from vidtrack.timing.fields import (
    Order,
    chosen_order,
    offsets,
    order_from_motion,
    order_from_pictures,
    split,
)
from vidtrack.video.reader import open_video

WIDTH, HEIGHT = 360, 240


def woven(i: int, order: str, x, y, radius: float = 6.0, noise: float = 3.0) -> np.ndarray:
    """A frame whose fields see a ball at x(t), y(t), t in frames, half a frame apart (progressive: together)."""
    top, bottom = {"top": (i, i + 0.5), "bottom": (i + 0.5, i), "progressive": (i, i)}[order]
    levels = np.empty((HEIGHT, WIDTH))
    for parity, t in ((0, top), (1, bottom)):
        levels[parity::2] = ball(WIDTH, HEIGHT, x(t), y(t), radius=radius, row0=parity, step=2)
    levels += np.random.default_rng(i).normal(0, noise, levels.shape)
    return np.clip(np.rint(levels), 16, 235).astype(np.uint8)


def centroid(luma: np.ndarray, parity: int = 0, step: int = 1) -> np.ndarray:
    """Of all that is brighter than its surroundings in a box about the brightest part, frame-buffer px (4.2.2)."""
    rows, columns = np.nonzero(luma > 110)
    box = 18
    x0, y0 = max(round(columns.mean()) - box, 0), max(round(rows.mean()) - box // step, 0)
    cut = luma[y0 : y0 + 2 * box // step + 1, x0 : x0 + 2 * box + 1].astype(float)
    weight = cut - np.median(luma)
    weight[weight < 12] = 0  # four times the noise
    y, x = np.mgrid[: cut.shape[0], : cut.shape[1]]
    return np.array([(weight * (x + x0)).sum(), (weight * (step * (y + y0) + parity)).sum()]) / weight.sum()


def fast(t):
    return 40 + 10.0 * t


def level(t):
    return 120.3 + 0.0 * t


def falling(t):
    return 60.2 + 4.0 * t


@pytest.mark.parametrize("order", ["top", "bottom"])
@pytest.mark.parametrize("y", [level, falling])
def test_at_10_px_a_frame_field_centroids_are_within_a_tenth_where_the_woven_frame_is_off_by_pixels(order, y):
    off_field, off_frame = [], []
    for i in range(20):
        luma = woven(i, order, fast, y)
        off_frame.append(centroid(luma) - (fast(i), y(i)))
        for field in split(luma, order):
            found = centroid(field.luma, field.parity, 2)
            off_field.append(found - (fast(i + field.offset), y(i + field.offset)))
    off_field, off_frame = np.array(off_field), np.array(off_frame)
    assert np.abs(off_field).max() < 0.1
    assert 0.003 < np.sqrt((off_field**2).mean())  # the noise is there
    assert np.sqrt((off_frame[:, 0] ** 2).mean()) > 2


def test_fields_in_the_wrong_order_are_off_by_half_the_speed():
    luma = woven(3, "top", fast, level)
    first, second = split(luma, "bottom")
    found = [centroid(field.luma, field.parity, 2)[0] - fast(3 + field.offset) for field in (first, second)]
    np.testing.assert_allclose(found, [5, -5], atol=0.15)


def test_fields_are_views_and_not_copies():
    luma = np.zeros((8, 6), np.uint8)
    for field in split(luma, "bottom"):
        assert np.shares_memory(field.luma, luma)
    assert [field.name for field in split(luma, "bottom")] == ["bottom", "top"]
    assert [field.offset for field in split(luma, "bottom")] == [0.0, 0.5]


@given(st.integers(1, 40), st.integers(1, 5), st.sampled_from(["top", "bottom"]))
def test_every_row_of_the_frame_is_in_one_field_at_its_place(height, width, order):
    luma = np.repeat(np.arange(height, dtype=np.uint8)[:, None], width, axis=1)
    rows = [2 * np.arange(len(field.luma)) + field.parity for field in split(luma, order)]
    stored = [field.luma[:, 0] for field in split(luma, order)]
    np.testing.assert_array_equal(np.concatenate(rows), np.concatenate(stored))
    assert sorted(np.concatenate(rows)) == list(range(height))


def test_an_order_that_is_none_is_refused():
    with pytest.raises(ValueError, match="'progressive'"):
        split(np.zeros((4, 4), np.uint8), "progressive")


def test_the_second_field_is_half_a_frame_later_and_progressive_pictures_are_not():
    names = np.array(["frame", "top", "bottom"])
    np.testing.assert_array_equal(offsets(names, "top"), [0, 0, 0.5])
    np.testing.assert_array_equal(offsets(names, "bottom"), [0, 0.5, 0])
    np.testing.assert_array_equal(offsets(names, "progressive"), [0, 0, 0])


def positions(order: str, n: int = 60, noise: float = 0.05, speed: float = 3.0, seed: int = 0):
    """Top and bottom positions (n, 2, 2) of two targets that swing."""
    t = np.arange(n)
    shift = {"top": (0, 0.5), "bottom": (0.5, 0), "progressive": (0, 0)}[order]

    def at(t):
        swing = speed * 20 / (2 * np.pi) * np.sin(2 * np.pi * t / 20)
        return np.stack([np.stack([100 + swing, 80 + 0.1 * t], -1), np.stack([200 + 0 * t, 90 - 0.5 * swing], -1)], 1)

    rng = np.random.default_rng(seed)
    return tuple(at(t + s) + rng.normal(0, noise, (n, 2, 2)) for s in shift)


@pytest.mark.parametrize("order", ["top", "bottom", "progressive"])
@pytest.mark.parametrize("speed", [0.6, 3.0, 25.0])
def test_the_motion_tells_the_order(order, speed):
    found = order_from_motion(*positions(order, speed=speed))
    assert found.order == order
    assert found.slope == pytest.approx({"top": 0.5, "bottom": -0.5, "progressive": 0}[order], abs=4 * found.sd + 0.01)
    assert found.sd < 0.08


@settings(max_examples=30, deadline=None)
@example(93, "bottom", 1.0, 0.375)
@given(
    st.integers(0, 10_000), st.sampled_from(["top", "bottom", "progressive"]), st.floats(0.0, 6.0), st.floats(0.01, 0.6)
)
def test_the_motion_never_tells_a_wrong_order(seed, order, speed, noise):
    assert order_from_motion(*positions(order, 40, noise, speed, seed)).order in (order, "unknown")


def test_the_standard_error_of_the_slope_is_honest():
    trials = [order_from_motion(*positions("top", seed=seed, noise=0.2)) for seed in range(60)]
    spread = np.std([trial.slope for trial in trials])
    assert 0.6 < spread / np.mean([trial.sd for trial in trials]) < 1.5


def test_lost_targets_and_outliers_do_not_turn_the_order():
    top, bottom = positions("top")
    top[5:15, 0] = np.nan
    bottom[30, 1] = np.nan
    bottom[[20, 40], :] += 30
    assert order_from_motion(top, bottom).order == "top"


def test_an_offset_between_the_fields_is_not_taken_for_motion():
    top, bottom = positions("progressive")
    assert order_from_motion(top, bottom + np.array([0.4, -0.3])).order == "progressive"


def test_without_motion_nobody_knows():
    top, bottom = positions("top", speed=0.0)
    assert order_from_motion(top, bottom).order == "unknown"
    empty = order_from_motion(np.full((10, 1, 2), np.nan), np.full((10, 1, 2), np.nan))
    assert empty.order == "unknown"
    assert empty.n == 0


def test_arrays_that_do_not_match_are_refused():
    with pytest.raises(ValueError, match="alike"):
        order_from_motion(np.zeros((5, 2)), np.zeros((6, 2)))


@pytest.mark.parametrize("order", ["top", "bottom", "progressive"])
@pytest.mark.parametrize(("speed", "radius"), [(1.0, 3.0), (3.0, 6.0), (8.0, 6.0), (30.0, 5.0)])
def test_whole_pictures_tell_the_order_or_say_that_they_cannot(order, speed, radius):
    found = order_from_pictures(woven(i, order, lambda t: 30 + speed * t, level, radius) for i in range(10))
    assert found.order in (order, "unknown")
    if 2 <= speed <= radius * 1.5:
        assert found.order == order
    if order != "progressive" and speed >= 3:
        assert found.combing > 0.4


def test_three_pictures_that_agree_by_chance_decide_no_order(monkeypatch):
    """Small balls comb as if interlaced, for one field sees not what lies in the other; their order is then noise."""
    rng = np.random.default_rng(0)
    monkeypatch.setattr(fields, "_unlikeness", lambda *_: (rng.normal(0, 0.2), 0.6))
    pictures = [np.zeros((4, 4), np.float32)] * 4
    assert {order_from_pictures(pictures).order for _ in range(1000)} == {"unknown"}


@given(st.floats(1e-3, 60), st.integers(1, 61))
def test_students_distribution_is_that_of_scipy(deviation, freedom):
    """Nearer to 0 scipy itself loses digits: of 1e-9 and one degree of freedom it makes 0."""
    from scipy.special import stdtr

    expected = 1 - 2 * stdtr(freedom, -deviation)
    assert fields._student_within(deviation, 1.0, freedom) == pytest.approx(expected, abs=1e-12)
    assert fields._student_within(3 * deviation, 3.0, freedom) == pytest.approx(expected, abs=1e-12)


def test_no_scatter_at_all_is_certain_and_the_order_of_fields_imports_no_scipy():
    assert fields._student_within(0.4, 0.0, 5) == pytest.approx(1.0)
    code = (
        "import sys, numpy as np; from vidtrack.timing.fields import order_from_pictures as f;"
        "p = [np.zeros((40, 40), np.uint8) for _ in range(6)];"
        "[a[10:20].__setitem__((slice(None), slice(5 + 2 * i, 15 + 2 * i)), 200) for i, a in enumerate(p)];"
        "print(f(iter(p)).n, 'scipy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["5", "False"]


def test_pictures_without_motion_tell_nothing():
    assert order_from_pictures(woven(i, "top", lambda t: 100.0, level) for i in range(8)).order == "unknown"
    assert order_from_pictures(iter([])).n == 0


def test_the_motion_wins_over_the_flags_and_says_so():
    moving = Order("top", 0.49, 0.01, 50)
    assert chosen_order("bottom", moving)[0] == "top"
    assert "the flags say bottom" in chosen_order("bottom", moving)[1]
    assert chosen_order("top", moving)[0] == "top"
    assert chosen_order("unknown", moving)[0] == "top"
    still = Order("unknown", np.nan, np.nan, 0)
    assert chosen_order("bottom", still)[0] == "bottom"
    assert chosen_order("unknown", still)[0] == "unknown"


def test_from_tape_to_order_through_a_real_codec(tmp_path: Path):
    # DV says nothing of its order, the H.264 is flagged wrongly on purpose: the motion knows
    for name, codec, pix_fmt, options, said in (
        ("tape.avi", "dvvideo", "yuv411p", {}, "bottom"),
        ("wrong.mp4", "libx264", "yuv420p", {"x264-params": "bff=1", "crf": "15"}, "bottom"),
    ):

        def picture(i: int) -> np.ndarray:
            luma = np.full((480, 720), 40, np.uint8)
            luma[100:340, 100:460] = woven(i, "top", lambda t: 40 + 5 * t, level, 8.0)
            return luma

        path = make_clip(
            tmp_path / name, codec, pix_fmt, n=16, size=(720, 480), picture=picture, options=options, rate=NTSC
        )
        with open_video(str(path)) as video:
            assert video.info.field_order == said
            places = [
                [centroid(field.luma, field.parity, 2) for field in split(frame.luma, "top")]
                for frame in video.frames()
            ]
        order = order_from_motion(*np.array(places).transpose(1, 0, 2))
        assert order.order == "top"
        assert chosen_order(said, order)[0] == "top"


def test_the_weighted_median_is_where_half_of_the_weight_is_reached():
    assert fields._weighted_median(np.array([3.0, 1, np.nan, 2]), np.array([5.0, 1, 9, 1])) == 3
    assert fields._weighted_median(np.array([3.0, 1, 2]), np.array([1.0, 1, 1])) == 2
    assert fields._weighted_median(np.array([3.0]), np.array([0.0])) == 0


def test_targets_that_stand_perfectly_still_give_no_slope():
    still = np.zeros((20, 3))
    slope, sd, moved = fields._common_slope(still + 0.1, still, np.ones(still.shape, bool))
    assert np.isnan([slope, sd]).all()
    assert moved == 0
