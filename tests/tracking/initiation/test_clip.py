"""A recording as it is tracked: how its opening is read, its fields, its grey levels and its noise."""

from fractions import Fraction

import numpy as np
import pytest

from tests.discs import picture
from vidtrack.errors import VidtrackError
from vidtrack.timing.fields import split
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.initiation.clip import OPENING, Clip, DetectSettings, batches

RATE = Fraction(25)
SHAPE = (96, 128)


def info(**changes):
    return VideoInfo(SHAPE[1], SHAPE[0], RATE, **{"field_order": "progressive", **changes})


def frames(n=20, *, contrast=180.0, noise=2.0, level=30.0, dtype=np.uint8, still=False, ball=True):
    out = []
    for k in range(n):
        rng = np.random.default_rng(0 if still else k)
        balls = [(30 + 2.0 * k, 40.0, 5.0)] if ball else []
        luma = picture(SHAPE, balls, level=level, contrast=contrast, noise=noise, rng=rng, dtype=dtype)
        out.append(Frame(k, k / RATE, luma, False, None))
    return out


def settings(**changes):
    usual = {
        "polarity": "bright",
        "threshold": "auto",
        "centroid": "weighted",
        "min_pixels": 4,
        "fields": "auto",
        "gain": "auto",
        "offset": "auto",
    }
    return DetectSettings(**{**usual, **changes})


def clip(pictures, size=5, about=None, repeated=(), most=100, **changes):
    return Clip(batches(pictures, size), about or info(), settings(**changes), repeated, most)


def test_frames_come_in_batches_the_last_of_which_may_be_short():
    assert [len(batch) for batch in batches(range(7), 3)] == [3, 3, 1]
    assert list(batches([], 3)) == []


def test_the_opening_is_read_in_whole_batches_and_nothing_is_lost_or_read_twice():
    own = clip(frames(40))
    assert [f.index for f in own.opening] == list(range(15))
    own.read_on(22)
    assert [f.index for f in own.opening] == list(range(25))
    own.read_on(10)
    assert len(own.opening) == 25
    assert [f.index for batch in own.batches for f in batch] == list(range(25, 40))
    assert OPENING.frames == 12


def test_a_short_recording_is_all_opening_and_an_empty_one_is_refused():
    assert len(clip(frames(3)).opening) == 3
    with pytest.raises(VidtrackError, match="no frame to track in"):
        clip([])


def test_a_frame_is_one_sample_at_its_time_in_samples():
    own = clip(frames(4)[1:], repeated={2})
    samples = own.samples(own.opening)
    assert own.order == "frame"
    assert [s.time for s in samples] == [1, 2, 3]
    assert [s.repeated for s in samples] == [False, True, False]
    assert all((s.parity, s.lines) == (0, 1) for s in samples)


@pytest.mark.parametrize("order", ["top", "bottom"])
def test_a_frame_of_two_fields_is_two_samples_half_a_frame_apart(order):
    own = clip(frames(3), fields=order)
    samples = own.samples(own.opening)
    assert own.order == order
    assert len(samples) == 6
    assert np.diff([s.time for s in samples]) == pytest.approx(np.ones(5))
    assert [s.parity for s in samples[:2]] == ([0, 1] if order == "top" else [1, 0])
    for sample, field in zip(samples, split(own.opening[0].luma, order), strict=False):
        np.testing.assert_array_equal(sample.luma, field.luma)
        assert sample.lines == 2


def test_a_damaged_frame_s_samples_are_damaged():
    pictures = frames(6)
    pictures[2] = pictures[2]._replace(corrupt=True)
    own = clip(pictures)
    assert [s.corrupt for s in own.samples(own.opening)] == [k == 2 for k in range(6)]


@pytest.mark.parametrize(
    ("about", "fields", "order", "says"),
    [
        (info(), "auto", "frame", "progressive, from the flags"),
        (info(field_order="top"), "frame", "frame", "as set"),
        (info(is_still=True, field_order="unknown"), "auto", "frame", "a still"),
    ],
)
def test_why_the_fields_are_taken_so_is_said(about, fields, order, says):
    own = clip(frames(6), about=about, fields=fields)
    assert own.order == order
    assert says in own.as_record()["fields"]


def combed(n, order):
    """A ball whose pictures are woven of fields that are half a frame apart."""
    out = []
    for k in range(n):
        rng = np.random.default_rng(k)
        top, bottom = (
            picture(SHAPE, [(30 + 3.0 * t, 40 + t, 5.0)], level=30, contrast=150, noise=2, rng=rng)
            for t in ((k, k + 0.5) if order == "top" else (k + 0.5, k))
        )
        top[1::2] = bottom[1::2]
        out.append(Frame(k, k / RATE, top, False, None))
    return out


@pytest.mark.parametrize("order", ["top", "bottom"])
def test_pictures_that_are_plainly_woven_are_not_progressive_whatever_the_flags_say(order):
    own = clip(combed(12, order))
    assert own.order == order
    assert "the flags say progressive" in own.as_record()["fields"]
    assert clip(combed(12, order), fields="frame").order == "frame"


@pytest.mark.parametrize("still", [True, False])
def test_noise_and_whole_pictures_do_not_contradict_the_flags(still):
    for seed in range(3):
        pictures = [
            f._replace(luma=np.random.default_rng([seed, f.index]).normal(90, 12, SHAPE).astype(np.uint8))
            for f in frames(12)
        ]
        assert clip(frames(12, still=still, noise=4.0)).order == clip(pictures).order == "frame"


def test_good_levels_are_left_as_they_are():
    own = clip(frames(6))
    assert own.as_record()["stretch"] == {"gain": 1.0, "offset": 0.0}
    assert own.detection.scale == 1.0
    assert own.detection.full == 255.0
    np.testing.assert_array_equal(own.opening[0].luma, frames(1)[0].luma)


def test_gain_and_offset_go_over_every_frame_and_over_the_noise():
    plain, own = clip(frames(30)), clip(frames(30), gain=2.0, offset=20.0)
    levels = own.as_record()["stretch"]
    assert levels["gain"] == pytest.approx(2.0, rel=0.01)
    assert levels["offset"] == pytest.approx(20.0, abs=0.5)
    assert own.detection.noise == pytest.approx(2 * plain.detection.noise, rel=0.02)
    later = next(own.batches)[0]
    raw = frames(30)[later.index].luma.astype(float)
    shown = later.luma.astype(float) * own.detection.scale
    np.testing.assert_allclose(shown, np.clip(2 * (raw - 20), 0, 255), atol=1.0)


def test_the_threshold_lies_between_the_background_and_the_target():
    own = clip(frames(6))
    assert 30 + 20 < own.level < 30 + 180 - 20
    assert own.detection.threshold is None
    set_ = clip(frames(6), threshold=90)
    assert (set_.level, set_.detection.threshold) == (90.0, 90.0)


def test_dark_targets_are_judged_on_the_picture_turned_over():
    dark = [f._replace(luma=255 - f.luma) for f in frames(6)]
    own, bright = clip(dark, polarity="dark"), clip(frames(6))
    assert own.level == pytest.approx(bright.level, abs=1.0)
    assert clip(dark, polarity="dark", threshold=100).level == 155.0


def test_ten_bits_have_grey_levels_of_eight():
    own = clip(frames(6, dtype=np.uint16), about=info(bits=10))
    assert own.detection.scale == pytest.approx(255 / 1023)
    assert own.detection.full == 1023.0
    assert own.detection.noise == pytest.approx(clip(frames(6)).detection.noise, rel=0.1)


@pytest.mark.parametrize(("still", "flickers"), [(True, True), (False, False)])
def test_a_grain_that_stands_still_is_no_noise_from_picture_to_picture(still, flickers):
    own = clip(frames(6, noise=8.0, still=still))
    assert own.detection.noise > OPENING.grainy
    assert (own.detection.flicker > 0) == flickers
    assert own.detection.moving_noise <= own.detection.noise


def test_what_the_user_may_set_reaches_the_detection():
    own = clip(frames(6), min_pixels=9, max_step=0.5, min_motion=3.0, max_clutter=0.1, max_occlusion=2)
    d = own.detection
    assert (d.min_pixels, d.max_step, d.min_motion, d.max_clutter, d.max_occlusion) == (9, 0.5, 3.0, 0.1, 2)


@pytest.mark.parametrize(
    ("turn", "first"), [({}, "top"), ({"rotation": 180}, "bottom"), ({"rotation": 180, "height": 95}, "top")]
)
def test_the_field_that_the_config_names_is_that_of_the_stored_picture(turn, first):
    own = frames()
    height = turn.get("height", SHAPE[0])
    own = [frame._replace(luma=frame.luma[:height]) for frame in own]
    shown = VideoInfo(SHAPE[1], height, RATE, field_order="top", rotation=turn.get("rotation", 0))
    clip = Clip(batches(iter(own), 4), shown, settings(fields="top"))
    assert clip.order == first


@pytest.mark.parametrize("rotation", [90, 270])
def test_fields_of_a_picture_on_its_side_are_refused(rotation):
    with pytest.raises(VidtrackError, match=r"are columns.*fields: frame"):
        Clip(batches(iter(frames()), 4), info(rotation=rotation), settings(fields="bottom"))


def begun_with(luma, corrupt, n=1):
    return [f._replace(luma=luma, corrupt=corrupt) for f in frames(20)[:n]] + frames(20)[n:]


@pytest.mark.parametrize("corrupt", [True, False])
@pytest.mark.parametrize("level", [0, 128])
def test_a_first_picture_that_is_unlike_the_others_sets_no_noise_and_no_threshold(level, corrupt):
    own, whole = clip(begun_with(np.full(SHAPE, level, np.uint8), corrupt)), clip(frames(20))
    assert own.detection.noise == pytest.approx(whole.detection.noise, rel=0.2)
    assert own.level == pytest.approx(whole.level, abs=3)


@pytest.mark.parametrize("corrupt", [True, False])
def test_pictures_that_show_nothing_are_no_part_of_what_the_opening_says_and_more_are_read_for_them(corrupt):
    own = clip(begun_with(np.full(SHAPE, 128, np.uint8), corrupt=corrupt, n=6), size=1)
    assert len(own.opening) == 12 + 6
    samples, order = own.shown()
    assert order.tolist() == list(range(6, 18))
    assert [one.time for one in samples] == [one.time for one in own.samples(own.opening)[6:]]
    assert len(clip(begun_with(np.full(SHAPE, 128, np.uint8), corrupt=corrupt, n=6), size=1, most=15).opening) == 15
    ruined = clip([f._replace(corrupt=True) for f in frames(20)], size=1)
    assert len(ruined.opening) == 20
    assert ruined.shown()[1].tolist() == list(range(20))
    assert np.isfinite(ruined.level)
