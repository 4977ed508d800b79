"""A ball on an averaged clip is measured as a tracked target is, and its sd can be trusted."""

from typing import NamedTuple

import numpy as np
import pytest

from vidtrack.labelling.shot import composite, look_again, take, with_placed
from vidtrack.tracking.detection.blobs import find_blobs


class F(NamedTuple):
    luma: np.ndarray
    corrupt: bool = False


def balls(at, *, radius=4.0, level=200.0, background=20.0, shape=(96, 128), fine=8):
    """Discs by counting fine x fine points a pixel: exact to 0.01 px, and nobody else's renderer."""
    offset = (np.arange(fine) + 0.5) / fine - 0.5
    X = (np.arange(shape[1])[:, None] + offset).ravel()
    Y = (np.arange(shape[0])[:, None] + offset).ravel()
    image = np.full(shape, float(background))
    for (x, y), high in zip(at, np.broadcast_to(level, len(at)), strict=True):
        inside = (X[None] - x) ** 2 + (Y[:, None] - y) ** 2 < radius**2
        image += (high - background) * inside.reshape(shape[0], fine, shape[1], fine).mean((1, 3))
    return image


def clip(image, n, noise=3.0, seed=0, dtype=np.uint8, full=255):
    rng = np.random.default_rng(seed)
    return [
        F(np.clip(np.rint(image * full / 255 + rng.normal(0, noise * full / 255, image.shape)), 0, full).astype(dtype))
        for _ in range(n)
    ]


AT = np.array(
    [
        (x + 0.37 * k % 1, y + 0.61 * k % 1)
        for k, (x, y) in enumerate([(20, 20), (60, 22), (100, 25), (24, 60), (64, 70), (104, 66)])
    ]
)


def test_the_sd_of_a_position_is_what_the_error_turns_out_to_be():
    errors, sd = [], []
    for seed in range(12):
        shot = take(clip(balls(AT), 16, seed=seed), {})
        order = np.lexsort((shot.at[:, 0], shot.at[:, 1] > 45))
        errors.append(shot.at[order] - AT)
        sd.append(shot.sd[order])
    # the pixels' own sampling of a sharp disc adds a few mpx, the same every time, which no scatter can tell
    assert np.abs(np.mean(errors, 0)).max() < 0.012
    # 144 coordinates tell a ratio of standard deviations to 6 %
    ratio = np.mean(np.std(errors, 0, ddof=1)) / np.sqrt(np.mean(np.square(sd)))
    assert 0.75 < ratio < 1.25


def test_a_lone_frame_has_the_sd_that_noise_and_contrast_make():
    errors, sd = [], []
    for seed in range(15):
        shot = take(clip(balls(AT), 1, seed=seed), {})
        order = np.lexsort((shot.at[:, 0], shot.at[:, 1] > 45))
        errors.append(shot.at[order] - AT)
        sd.append(shot.sd[order])
        assert np.isnan(shot.scatter).all()
    assert 0.7 < np.std(errors) / np.sqrt(np.mean(np.square(sd))) < 1.3


def test_a_lone_frame_is_measured_exactly_as_the_tracker_measures_it():
    frame = clip(balls(AT), 1)[0]
    shot, blobs = take([frame], {}), find_blobs(frame.luma)
    assert (shot.at == np.stack([blobs.Xf, blobs.Yf], -1)).all()


def test_ten_bit_luma_gives_the_same_grey_levels_and_places():
    image = balls(AT)
    eight, ten = take(clip(image, 8), {}), take(clip(image, 8, dtype=np.uint16, full=1023), {}, bits=10)
    assert np.abs(eight.still.mean - ten.still.mean).mean() < 0.2
    assert ten.at == pytest.approx(eight.at, abs=0.01)


def test_dark_balls_are_found_when_told_so():
    image = 220 - balls(AT, level=200, background=0)
    assert len(take(clip(image, 4), {}).at) != len(AT)
    assert take(clip(image, 4), {"polarity": "dark"}).at == pytest.approx(take(clip(255 - image, 4), {}).at, abs=0.05)


def test_a_ball_too_dim_for_the_picture_shows_in_a_window_of_its_own():
    level = np.array([230, 230, 230, 230, 230, 60.0])
    shot = take(clip(balls(AT, level=level), 8), {"threshold": 100})
    assert len(shot.at) == 5
    again = look_again(shot, AT[5] + 1, 15)
    assert again is not None
    assert np.linalg.norm(again.at - AT[5], axis=-1).min() < 0.05
    assert look_again(shot, np.array([84.0, 45.0]), 12) is None


def test_the_composite_shows_the_balls_of_all_clips():
    parts = [take(clip(balls(AT[k : k + 1]), 4), {}) for k in range(6)]
    whole = composite(parts)
    assert whole.dtype == np.uint8
    assert find_blobs(whole).Xf.size == 6
    dark = [take(clip(220 - balls(AT[k : k + 1], background=0), 4), {"polarity": "dark"}) for k in range(6)]
    assert find_blobs(composite(dark), polarity="dark").Xf.size == 6
    with pytest.raises(ValueError, match="no shots"):
        composite([])


@pytest.mark.parametrize("n", [1, 9])
@pytest.mark.parametrize(
    ("contrast", "noise", "kind", "full"),
    [(1, 8.0, np.uint16, 4095), (6, 0.5, np.uint8, 255), (-6, 0.5, np.uint8, 255)],
)
def test_few_grey_levels_are_stretched(n, contrast, noise, kind, full):
    if kind is np.uint16:  # a twelve-bit sensor in a file of sixteen
        frames = clip(balls(AT), n, noise=2.0, dtype=kind, full=full)
    else:
        frames = clip(balls(AT, background=100, level=100 + contrast), n, noise=noise, dtype=kind, full=full)
    shot = take(frames, {"polarity": "dark" if contrast < 0 else "bright"})
    assert shot.stretch[0] > 8
    assert len(shot.at) == 6
    order = np.lexsort((shot.at[:, 0], shot.at[:, 1] > 45))
    off = shot.at[order] - AT
    assert np.abs(off).max() < 4 * np.hypot(shot.sd.max(), 0.01)
    assert np.abs(off).max() < (0.05 if kind is np.uint16 else 0.35)
    assert take(frames, {"gain": 1.0, "offset": 0.0}).stretch == (1.0, 0.0)


def test_a_point_that_was_placed_by_hand_is_a_blob_with_the_persons_sd():
    shot = take(clip(balls(AT), 5), {})
    placed = with_placed(shot, np.array([[12.5, 80.25, 0.4]]))
    assert len(placed.at) == len(shot.at) + 1
    assert placed.at[-1].tolist() == [12.5, 80.25]
    assert placed.sd[-1].tolist() == [0.4, 0.4]
    assert placed.blobs.pixels[-1] == 0
    assert not placed.blobs.edge[-1]
    np.testing.assert_array_equal(placed.at[:-1], shot.at)


def test_a_point_placed_on_a_ball_takes_its_place():
    shot = take(clip(balls(AT), 5), {})
    placed = with_placed(shot, np.array([[*(AT[2] + (1.0, 0.5)), 0.3]]))
    assert len(placed.at) == len(shot.at)
    assert np.hypot(*(placed.at - AT[2]).T).min() == pytest.approx(np.hypot(1, 0.5))


def test_without_points_placed_by_hand_nothing_changes():
    shot = take(clip(balls(AT), 5), {})
    assert with_placed(shot, np.empty((0, 3))) is shot


@pytest.mark.parametrize(("off", "taken"), [(6.4, False), (5.4, True)])
@pytest.mark.parametrize("side", [(-1, 0), (1, 0), (0, -1), (0, 1)])
def test_a_point_placed_within_two_pixels_of_a_blobs_box_stands_for_it(off, taken, side):
    shot = take(clip(balls([(60.0, 40.0)]), 5), {})  # its box reaches from 56 to 64, and from 36 to 44
    placed = with_placed(shot, np.array([[60.0 + off * side[0], 40.0 + off * side[1], 0.3]]))
    assert len(placed.at) == 2 - taken
