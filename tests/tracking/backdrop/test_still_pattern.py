import tracemalloc

import cv2
import numpy as np
import pytest
from scipy.special import ndtr

from vidtrack.tracking.backdrop import still_pattern
from vidtrack.tracking.backdrop.still_pattern import StillPattern, kernels
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import BACKGROUND, MASS, MEASURED, PIXELS, SD_X, SD_Y, Rows, X, Y

RADIUS, LEVEL, SHAPE = 5.0, 210.0, (120, 220)
MASS_OF = 11_000.0
NOISE = 1.5


def rough(seed: int, grain: float, contrast: float) -> np.ndarray:
    picture = cv2.GaussianBlur(np.random.default_rng(seed).normal(0, 1, SHAPE).astype(np.float32), (0, 0), grain)
    return 90 + picture / picture.std() * np.float32(contrast)


def noisy(picture: np.ndarray, seed: int) -> np.ndarray:
    return np.rint(picture + np.random.default_rng(seed).normal(0, NOISE, picture.shape)).astype(np.uint8)


def with_ball(picture: np.ndarray, x: float, y: float) -> np.ndarray:
    off = np.hypot(np.arange(SHAPE[1]) - x, np.arange(SHAPE[0])[:, None] - y)
    return picture + ndtr((RADIUS - off) / 0.75) * (LEVEL - picture)


def centroid(picture: np.ndarray, x: float, y: float) -> tuple[float, float, float]:
    """First moments of the light about the nearest pixel, over the plane of a ring, and their mass."""
    column, row = round(x), round(y)
    down, across = np.mgrid[-14:15, -14:15]
    here = picture[row - 14 : row + 15, column - 14 : column + 15].astype(float)
    d = np.hypot(across, down)
    ring, within = (d > 9) & (d <= 13), d <= RADIUS + 2
    basis = np.stack([np.ones(29 * 29), across.ravel(), down.ravel()], 1)
    over = here - (basis @ np.linalg.lstsq(basis[ring.ravel()], here[ring], rcond=None)[0]).reshape(29, 29)
    mass = over[within].sum()
    return column + (over * across)[within].sum() / mass, row + (over * down)[within].sum() / mass, mass


def measured(pattern: np.ndarray) -> tuple[Rows, np.ndarray]:
    """What a ball that goes over a pattern shows, and where it truly is (60, 2)."""
    t = np.arange(60)
    true = np.stack([20 + 3.1 * t, 60 + 30 * np.sin(t / 9)], 1)
    values = np.zeros((MEASURED, 60, 1))
    for i, (x, y) in enumerate(true):
        values[[X, Y, MASS], i, 0] = centroid(noisy(with_ball(pattern, x, y), 100 + i), x, y)
    values[PIXELS], values[BACKGROUND] = np.pi * RADIUS**2, 90.0
    values[[SD_X, SD_Y]] = 0.008
    return Rows(values, np.zeros((60, 1, 2)), np.zeros((60, 1), np.int64), np.zeros(60)), true


def taken_off(rows: Rows, pattern: np.ndarray, late: np.ndarray) -> bool:
    none = np.zeros(len(rows.flag), int)
    return StillPattern({0: noisy(pattern, 1)}, Detection(noise=NOISE)).take_off(rows, none, [Sample(late, 99.0)])


def changed(pattern: np.ndarray, late: np.ndarray) -> tuple[Rows, Rows, np.ndarray]:
    rows, true = measured(pattern)
    before = rows._replace(values=rows.values.copy())
    assert taken_off(rows, pattern, late)
    return before, rows, true


def stay(pattern: np.ndarray, late: np.ndarray) -> bool:
    rows, _ = measured(pattern)
    before = rows.values.copy()
    return not taken_off(rows, pattern, late) and np.array_equal(rows.values, before)


def z2(rows: Rows, true: np.ndarray) -> np.ndarray:
    error = rows.values[[X, Y], :, 0].T - true
    return np.square(error / rows.values[[SD_X, SD_Y], :, 0].T)


@pytest.mark.parametrize(("grain", "contrast"), [(1.5, 15.0), (3.0, 10.0), (6.0, 15.0)])
def test_a_pattern_behind_a_moving_target_is_taken_off_and_what_is_left_is_in_the_sd(grain, contrast):
    pattern = rough(3, grain, contrast)
    before, after, true = changed(pattern, noisy(pattern, 2))
    assert np.sqrt(z2(before, true).mean()) > 2.5  # wrong by far more than noise says
    assert np.sqrt(z2(after, true).mean()) < 1.3
    assert z2(after, true).max() < 16
    off = [np.sqrt(np.mean((rows.values[[X, Y], :, 0].T - true) ** 2)) for rows in (before, after)]
    assert off[1] < 0.6 * off[0]


def test_where_there_is_no_pattern_not_a_digit_changes():
    plain = np.full(SHAPE, 40, np.float32)
    assert stay(plain, noisy(plain, 2))


def test_noise_that_stood_still_only_in_the_beginning_is_no_pattern():
    pattern = rough(3, 2.0, 12.0)
    assert stay(pattern, noisy(rough(4, 2.0, 12.0), 2))


def test_even_light_pulls_nothing():
    for weights in kernels(5.0, 5.0):
        assert abs(weights.sum()) < 1e-9


def test_a_sample_without_light_keeps_its_position_beside_others_that_are_corrected():
    pattern = rough(3, 3.0, 15.0)
    rows, _ = measured(pattern)
    rows.values[MASS, 7] = 0.0
    before = rows.values.copy()
    assert taken_off(rows, pattern, noisy(pattern, 2))
    assert (rows.values[[X, Y], 7] == before[[X, Y], 7]).all()
    assert (rows.values[X, 8:20] != before[X, 8:20]).all()


def test_rows_of_hours_need_no_second_copy_and_a_part_at_a_time_gives_the_same():
    pattern = rough(3, 3.0, 15.0)
    short, _ = measured(pattern)
    many = 5000
    rows = Rows(*(np.tile(column, (1, many, 1)) for column in short[:1]), *(np.repeat(c, many, 0) for c in short[1:]))
    taken_off(short, pattern, noisy(pattern, 2))
    tracemalloc.start()
    assert taken_off(rows, pattern, noisy(pattern, 2))
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 0.7 * rows.values.nbytes
    np.testing.assert_array_equal(rows.values, np.tile(short.values, (1, many, 1)))


def prepared(pattern: np.ndarray, rows: Rows, late: np.ndarray, calls: int = 40) -> StillPattern:
    still = StillPattern({0: noisy(pattern, 1)}, Detection(noise=NOISE))
    for _ in range(calls):
        still.prepare(lambda: Rows(rows.values[:, :20], *(column[:20] for column in rows[1:])), [Sample(late, 20.0)])
    return still


def made_once_more(*_):
    raise AssertionError


def test_pictures_that_are_made_while_the_recording_is_read_change_no_digit_and_are_not_made_again(monkeypatch):
    pattern = rough(3, 3.0, 15.0)
    late, none = noisy(pattern, 2), np.zeros(60, int)
    at_the_end, rows = measured(pattern)[0], measured(pattern)[0]
    assert taken_off(at_the_end, pattern, late)
    still = prepared(pattern, rows, noisy(pattern, 5))
    monkeypatch.setattr(still_pattern, "_pull_and_size", made_once_more)
    assert still.take_off(rows, none, [Sample(late, 99.0)])
    np.testing.assert_array_equal(rows.values, at_the_end.values)


def test_where_no_pattern_shows_when_it_is_looked_for_none_is_prepared(monkeypatch):
    monkeypatch.setattr(still_pattern, "_pull_and_size", made_once_more)
    pattern = rough(3, 3.0, 15.0)
    prepared(pattern, measured(pattern)[0], noisy(rough(4, 3.0, 15.0), 5))


def test_pictures_that_would_take_too_much_memory_are_made_at_the_end(monkeypatch):
    pattern = rough(3, 3.0, 15.0)
    late, rows = noisy(pattern, 2), measured(pattern)[0]
    settings = still_pattern.StillPatterns(ahead_bytes=pattern.size * 16 - 1)
    monkeypatch.setattr(still_pattern, "STILL_PATTERN", settings)
    still = prepared(pattern, rows, late)
    monkeypatch.setattr(still_pattern, "_pull_and_size", made_once_more)
    with pytest.raises(AssertionError):
        still.take_off(rows, np.zeros(60, int), [Sample(late, 99.0)])
