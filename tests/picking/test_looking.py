import numpy as np
import pytest

from vidtrack.picking.looking import grey_of, inside, look_at, mask_of, nearest


def picture(depth=8, dark=False):
    """Two discs of radius 5 at (40, 30) and (80.5, 50), 120 grey levels above 40, without noise."""
    y, x = np.mgrid[0:90, 0:120]
    image = np.full(x.shape, 40.0)
    for cx, cy in ((40, 30), (80.5, 50)):
        image += 120 * np.clip(5.5 - np.hypot(x - cx, y - cy), 0, 1)
    if dark:
        image = 255 - image
    return np.rint(image * (2**depth - 1) / 255).astype(np.uint8 if depth == 8 else np.uint16)


@pytest.mark.parametrize("depth", [8, 10, 16])
@pytest.mark.parametrize("dark", [False, True])
def test_a_target_is_measured_alike_on_any_depth_and_polarity(depth, dark):
    detect = {"polarity": "dark" if dark else "bright", "threshold": "auto", "min_pixels": 4, "fields": "frame"}
    look = look_at(picture(depth, dark), depth, None, detect, "unknown")
    blob = nearest(look, 42, 28, 3)
    assert (blob["Xf"], blob["Yf"]) == pytest.approx((40, 30), abs=0.02)
    assert blob["contrast"] == pytest.approx(120, abs=1)
    assert len(look.blobs.Xf) == 2
    mask = mask_of(look)
    assert mask[30, 40] == 255
    assert mask[0, 0] == 0
    assert abs(int((mask[:, :60] > 0).sum()) - blob["pixels"]) <= 2


def test_only_what_is_within_reach_is_found_and_the_one_under_the_cursor_first():
    look = look_at(picture(), 8, None, {"fields": "frame"}, "unknown")
    assert nearest(look, 60, 40, 3) is None
    assert nearest(look, 60, 40, 30) is not None
    assert nearest(look, 80, 50, 3)["Xf"] == pytest.approx(80.5, abs=0.02)


def test_a_box_holds_the_blobs_whose_middles_lie_in_it():
    look = look_at(picture(), 8, None, {"fields": "frame"}, "unknown")
    assert len(inside(look, 0, 0, 120, 90)) == 2
    (one,) = inside(look, 30, 20, 20, 20)
    assert one["Xf"] == pytest.approx(40, abs=0.02)
    assert inside(look, 0, 0, 10, 10) == []


def test_a_field_is_measured_in_the_frame_buffers_rows():
    both = picture()
    both[1::2] = 40  # the other field, a sixtieth later, shows nothing
    look = look_at(both, 8, None, {"fields": "auto"}, "top")
    blob = nearest(look, 40, 30, 3)
    assert (blob["Xf"], blob["Yf"]) == pytest.approx((40, 30), abs=0.15)
    assert mask_of(look).shape == (90, 120)


def test_grey_levels_are_stretched_between_black_and_white():
    image = np.arange(256, dtype=np.uint8).reshape(16, 16)
    shown = grey_of(image, 8, 100, 150)
    assert shown.ravel()[100] == 0
    assert shown.ravel()[125] == 127
    assert shown.ravel()[150] == 255
    deep = grey_of((image.astype(np.uint16) * 4).clip(0, 1023), 10, 100, 150)
    assert abs(int(deep.ravel()[125]) - 125) <= 1  # 500 of 1023 is grey level 124.6
