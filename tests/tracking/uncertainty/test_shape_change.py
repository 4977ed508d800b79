from dataclasses import replace

import cv2
import numpy as np
import pytest

from vidtrack.tracking.state import CONTRAST, MASS, MEASURED, PIXELS, SD_X, SD_Y, XX, XY, YY, X, Y
from vidtrack.tracking.uncertainty import shape_change
from vidtrack.tracking.uncertainty.shape_change import shape_evidence, shape_evidence_of_others

K, RADIUS, SD = 80, 5.0, 0.01
TIME = np.arange(K, dtype=float)


def moments(light: np.ndarray) -> tuple[float, ...]:
    """Mass, middle and second moments of a picture of light."""
    y, x = np.indices(light.shape)
    mass = light.sum()
    mx, my = (light * x).sum() / mass, (light * y).sum() / mass
    return mass, mx, my, *((light * a).sum() / mass for a in ((x - mx) ** 2, (y - my) ** 2, (x - mx) * (y - my)))


def disc(x: float, y: float) -> np.ndarray:
    off = np.hypot(np.arange(60) - x, np.arange(40)[:, None] - y)
    return np.clip(RADIUS + 0.5 - off, 0, 1)


def filmed(course, spoil=lambda light, i: light, stations: int = 1, exposure: float = 0.0) -> np.ndarray:
    """Values of a target on a course over whole samples: a picture of 60 x 40 px about it."""
    rng = np.random.default_rng(5)
    values = np.zeros((MEASURED, K, 1))
    for i in range(K):
        home = np.rint(course(float(i))) - (30, 20)
        late = ((np.arange(stations) + 0.5) / stations - 0.5) * exposure
        light = np.mean([disc(*(course(i + t) - home)) for t in late], axis=0)
        light = spoil(light, i) + rng.normal(0, 0.004, light.shape) * (light > 0.01)
        mass, x, y, *second = moments(np.maximum(light, 0))
        values[[X, Y, MASS, PIXELS], i, 0] = (x + home[0], y + home[1], 100 * mass, (light > 0.5).sum())
        values[[XX, YY, XY], i, 0] = second
    values[[SD_X, SD_Y]] = SD
    return values


def with_shape_told(values: np.ndarray, time: np.ndarray, lines: int = 1) -> tuple[np.ndarray, float]:
    """The values with what their shapes tell, and the exposure."""
    told, out = shape_evidence(values, time, lines), values.copy()
    out[[X, Y]], out[[SD_X, SD_Y]] = told.position, np.hypot(values[[SD_X, SD_Y]], told.sd)
    return out, told.exposure


def slow(t: float) -> np.ndarray:
    return np.array([100 + 20 * np.sin(t / 15), 80 + 12 * np.cos(t / 11)])


def quick(t: float) -> np.ndarray:
    return np.array([300 + 60 * np.sin(t / 5), 200 + 40 * np.cos(t / 6)])


def error(values: np.ndarray, course) -> np.ndarray:
    return values[[X, Y], :, 0].T - np.array([course(t) for t in TIME])


def test_a_clean_target_keeps_its_sd_and_its_place():
    values = filmed(slow)
    told, exposure = with_shape_told(values, TIME)
    assert exposure == 0
    assert np.array_equal(told[[X, Y]], values[[X, Y]])
    assert (told[SD_X] > 1.001 * SD).mean() < 0.02


def rope(light: np.ndarray, i: int) -> np.ndarray:
    light = light.copy()
    if 30 <= i < 44:  # it goes from one rim to the other
        light[:, 30 - 6 + (i - 30) : 30 - 6 + (i - 30) + 2] = 0
    return light


def spot(light: np.ndarray, i: int) -> np.ndarray:
    light = light.copy()
    if i % 20 == 5:
        light[22:25, 32:35] += 0.8
    return light


@pytest.mark.parametrize("spoil", [rope, spot], ids=["a dark rope before it", "a flash on its rim"])
def test_what_hides_or_lights_a_part_of_a_target_is_in_its_sd(spoil):
    values = filmed(slow, spoil)
    told, _ = with_shape_told(values, TIME)
    off = np.abs(error(values, slow))
    hurt = np.array([not np.array_equal(spoil(disc(30, 20), i), disc(30, 20)) for i in range(K)])
    assert (off[hurt] > 5 * SD).any(axis=1).sum() >= 4  # wrong, by what noise alone says
    assert (off < 5 * told[[SD_X, SD_Y], :, 0].T).all()
    assert (told[SD_X, ~hurt] < 1.5 * SD).mean() > 0.98


def test_the_middle_of_a_streak_is_put_to_the_middle_of_the_exposure():
    values = filmed(quick, stations=24, exposure=0.8)
    told, exposure = with_shape_told(values, TIME)
    assert exposure == pytest.approx(0.8, abs=0.05)
    inner = slice(1, -1)
    before, after = (np.sqrt(np.mean(error(one, quick)[inner] ** 2)) for one in (values, told))
    assert before > 3 * SD
    assert after < before / 4
    assert (np.abs(error(told, quick)) < 5 * told[[SD_X, SD_Y], :, 0].T).all()


def test_rows_of_a_field_count_in_px_of_the_frame():
    """An exposure of a target in fields, whose moments are those of the frame buffer already."""
    values = filmed(quick, stations=24, exposure=0.8)
    values[PIXELS] /= 2
    told, exposure = with_shape_told(values, TIME, lines=2)
    assert exposure == pytest.approx(0.8, abs=0.05)
    assert np.isfinite(told[[X, Y, SD_X, SD_Y]]).all()


def test_samples_without_moments_stay_as_they_are():
    values = filmed(slow)
    values[[XX, YY, XY]] = np.nan
    told, exposure = with_shape_told(values, TIME)
    assert exposure == 0
    assert np.array_equal(told, values, equal_nan=True)


def cut_off(light: np.ndarray, i: int) -> np.ndarray:
    """A post hides up to two thirds of the target, for more than half of the time."""
    light = light.copy()
    if i >= 34:
        light[:, : 26 + min(i - 34, 6)] = 0
    return light


def test_a_target_that_is_hidden_in_part_for_most_of_the_time_is_measured_by_its_whole_shape():
    values = filmed(slow, cut_off)
    out, _ = with_shape_told(values, TIME)
    off = np.abs(error(values, slow))
    assert (off[40:] > 20 * SD).any(axis=1).all()
    assert (off < 5 * out[[SD_X, SD_Y], :, 0].T).all()
    assert (out[SD_X, :34] < 1.5 * SD).mean() > 0.95


def test_fits_without_moments_hold_what_their_light_and_pixels_say_is_hidden():
    values, whole = filmed(slow, cut_off), filmed(slow)
    values[[XX, YY, XY], 34:] = np.nan
    out, _ = with_shape_told(values, TIME)
    off = np.abs(error(values, slow))
    assert (off[40:] > 20 * SD).any(axis=1).all()
    assert (off < 5 * out[[SD_X, SD_Y], :, 0].T).all()
    whole[[XX, YY, XY], 34:] = np.nan
    whole[MASS] *= 1 + 0.4 * np.sin(TIME)[:, None]  # a lamp that flickers hides nothing
    assert (with_shape_told(whole, TIME)[0][SD_X, 34:] > 1.5 * SD).mean() < 0.05
    whole = filmed(slow)
    whole[[XX, YY, XY], 34:] = np.nan
    whole[PIXELS, 34:] *= 0.6  # nor do pixels that a neighbour takes
    assert (with_shape_told(whole, TIME)[0][SD_X, 34:] > 1.5 * SD).mean() < 0.05


def test_a_disc_fitted_to_a_part_that_has_more_light_than_the_whole_is_no_whole_one():
    """A ball that comes out from behind a mast was 2 to 3 px off in x with an sd of 0.05."""
    values = filmed(slow)
    values[[XX, YY, XY], 34:] = np.nan
    values[PIXELS, 34:] *= 0.5
    values[MASS, 34:] *= 1.3
    radius = float(np.sqrt(np.median(values[PIXELS, :34]) / np.pi))
    sd = with_shape_told(values, TIME)[0][[SD_X, SD_Y], 34:]
    assert (sd > 0.15 * radius).all()
    assert (sd < 0.5 * radius).all()


def test_other_tracks_are_corrected_as_those_of_the_targets():
    """Tracks of few samples have the exposure and the usual shape of the targets."""
    target = filmed(quick, stations=24, exposure=0.8)
    of = shape_evidence(target, TIME)
    long, short = filmed(quick, stations=24, exposure=0.8), filmed(quick, rope, stations=24, exposure=0.8)[:, 32:40]
    values = np.concatenate([long[:, :, 0], short[:, :, 0]], axis=1)
    track, sample = np.repeat([7, 3], [K, 8]), np.concatenate([np.arange(K), np.arange(32, 40)])
    mixed = np.random.default_rng(1).permutation(track.size)
    position, sd = shape_evidence_of_others(values[:, mixed], track[mixed], sample[mixed], TIME, of)
    back = np.argsort(mixed)
    truth = np.array([quick(float(t)) for t in sample]).T
    assert np.allclose(position[:, back[:K]], of.position[:, :, 0])
    off = np.abs(position[:, back] - truth)[:, K:]
    assert (off > 5 * SD).any()
    assert (off < 6 * np.hypot(sd[:, back], SD)[:, K:]).all()


def test_the_ends_of_a_streaking_track_are_no_odd_shapes():
    """What is not known there is the acceleration alone: their sd was 3 to 11 px."""
    values = filmed(quick, stations=24, exposure=0.8)
    assert with_shape_told(values, TIME)[0][[SD_X, SD_Y]][:, [0, -1]].max() < 0.5


def grazed(light: np.ndarray, i: int) -> np.ndarray:
    """A post stands before a rim most of the time, now deeper, now less."""
    light = light.copy()
    if i >= 16:
        light[:, : int(26 + 2 * abs(np.sin(i / 7)))] = 0
    return light


def test_a_target_that_is_hidden_most_of_the_time_has_the_usual_shape_of_the_others():
    """Its own would be one of which a part is hidden: its sd was 0.01 px where it was 0.2 px off."""
    values = np.concatenate([filmed(slow, grazed), filmed(slow), filmed(quick)], axis=2)
    out = np.hypot(values[[SD_X, SD_Y]], shape_evidence(values, TIME).sd)
    off = np.abs(error(values, slow))
    assert (off[16:, 0] > 5 * SD).mean() > 0.9
    assert (off < 5 * out[..., 0].T).all()
    assert (out[:, :, 1:] < 1.5 * SD).mean() > 0.94


def shaded(light: np.ndarray, i: int) -> np.ndarray:
    """For twelve samples a thread hides so little of a rim that no single sample shows it for certain."""
    light = light.copy()
    if 40 <= i < 52:
        light[:, 24:27] *= 0.85
    return light


def test_what_is_hidden_for_several_samples_shows_in_them_together(monkeypatch):
    values = filmed(slow, shaded)
    off = np.abs(error(values, slow))

    def beyond() -> int:
        out = with_shape_told(values, TIME)[0]
        return int((off > 4 * out[[SD_X, SD_Y], :, 0].T).any(axis=1).sum())

    together = beyond()
    monkeypatch.setattr(shape_change, "SHAPES", replace(shape_change.SHAPES, lasting=K + 1))
    assert together <= beyond() / 2


def test_a_target_that_comes_nearer_is_compared_with_where_its_light_leads_to():
    """It grows by 2 % a sample; then, fitted as a disc, a part of it is hidden."""
    values = filmed(slow, cut_off)
    whole, nearer = filmed(slow), np.exp(0.02 * TIME)[:, None]
    for one in (values, whole):
        one[[MASS, PIXELS]] *= nearer
        one[[XX, YY, XY]] *= nearer
        one[[XX, YY, XY], 34:] = np.nan
    off = np.abs(error(values, slow))
    out, _ = with_shape_told(values, TIME)
    assert (off[38:60] > 20 * SD).any(axis=1).all()
    assert (off[38:60] < 5 * out[[SD_X, SD_Y], 38:60, 0].T).all()
    assert (with_shape_told(whole, TIME)[0][SD_X, 34:40] < 3 * SD).all()


def behind_a_drop(light: np.ndarray, i: int) -> np.ndarray:
    """What is behind a drop on the lens is spread and moved, the more the longer it has been there."""
    if i >= 50:
        return light
    bent = np.roll(cv2.GaussianBlur(light, (0, 0), 2.5 + i / 50), 2, axis=1)
    return 0.4 * light + 0.6 * bent


def test_a_target_that_is_spread_for_most_of_the_time_is_measured_by_how_it_looks_without():
    values = filmed(slow, behind_a_drop)
    values[CONTRAST], clear = 100.0, slice(52, None)
    values[CONTRAST, :50] = 50.0
    values[PIXELS, :50] = 1.9 * np.median(values[PIXELS, clear])
    told, _ = with_shape_told(values, TIME)
    assert np.median(told[SD_X, clear]) < 1.01 * SD
    spread = slice(2, 48)
    assert (np.abs(error(told, slow))[spread, 0] < 5 * told[SD_X, spread, 0]).all()
    dim = values.copy()
    dim[CONTRAST] = 100.0  # as if the light were as it was: then they are what the target usually is
    assert np.median(with_shape_told(dim, TIME)[0][SD_X, clear]) > 5 * SD


def test_light_that_changes_spreads_nothing():
    values = filmed(slow)
    values[CONTRAST] = 100.0
    values[CONTRAST, 20:] = 40.0
    told, _ = with_shape_told(values, TIME)
    assert (told[SD_X] > 1.001 * SD).mean() < 0.02
