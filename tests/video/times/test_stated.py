"""What containers state is put right where it is known to be wrong, and believed elsewhere."""

from fractions import Fraction
from types import SimpleNamespace as Thing

import av
import pytest

from tests.files.clips import NTSC, make_clip
from vidtrack.video.times.stated import LOST_SHARE, flagged_order, measured_rate, stated_duration, stated_rate


def stream(average, guessed=None, base=None, **more):
    return Thing(average_rate=average, guessed_rate=guessed, base_rate=base, **more)


def container(kind="mov,mp4,m4a,3gp,3g2,mj2"):
    return Thing(format=Thing(name=kind))


@pytest.mark.parametrize(
    ("kind", "told", "rate"),
    [
        ("mov", stream(Fraction(25)), 25),
        ("mov", stream(Fraction(24), Fraction(25)), 25),  # one of 25 frames was lost
        ("mov", stream(Fraction(25) * Fraction(61, 100), Fraction(25)), 25),
        ("mov", stream(Fraction(25) * Fraction(59, 100), Fraction(25)), Fraction(59, 4)),  # half: fields counted
        ("mov", stream(Fraction(17), Fraction(18)), 17),  # no common rate is near
        ("mov", stream(None, None, Fraction(50)), 50),
        ("mov", stream(None), 25),
        ("dv", stream(Fraction(60000), Fraction(60000), NTSC), NTSC),
    ],
)
def test_the_rate_that_was_meant(kind, told, rate):
    assert stated_rate(container(kind), told) == rate
    assert LOST_SHARE == 0.4


@pytest.mark.parametrize("rate", [Fraction(25), NTSC, Fraction(12)])
def test_the_rate_of_a_real_file_is_measured_from_its_stamps(tmp_path, rate):
    clip = make_clip(tmp_path / "a.mkv", "ffv1", "gray", n=20, size=(32, 32), rate=rate)
    # Matroska counts in ms; a common rate is meant, another is as exact as the stamps
    assert measured_rate(str(clip), 0) == pytest.approx(rate, rel=3e-3)
    with av.open(str(clip)) as opened:
        assert stated_rate(opened, opened.streams.video[0]) == pytest.approx(rate, rel=1e-5)


def test_lost_frames_do_not_lower_a_measured_rate(tmp_path):
    stamps = [i for i in range(40) if i not in (7, 8, 9, 20, 31)]
    clip = make_clip(
        tmp_path / "a.mkv",
        "ffv1",
        "gray",
        n=35,
        size=(32, 32),
        rate=Fraction(25),
        stamps=stamps,
        stamp_base=Fraction(1, 25),
    )
    assert measured_rate(str(clip), 0) == 25


def test_two_pictures_tell_no_rate(tmp_path):
    clip = make_clip(tmp_path / "a.mkv", "ffv1", "gray", n=2, size=(32, 32), rate=Fraction(25))
    assert measured_rate(str(clip), 0) is None


def test_a_browser_s_thousand_frames_a_second_are_measured_instead():
    """Its header states the scale of its stamps; the file named here does not exist, so that it must be looked for."""
    told = stream(Fraction(1000), Fraction(1000), index=0)
    opened = Thing(format=Thing(name="matroska,webm"), name="file:/nowhere/at/all.webm")
    with pytest.raises(Exception, match=r"all\.webm"):
        stated_rate(opened, told)


MS = Fraction(1, 1000)


@pytest.mark.parametrize(
    ("kind", "told", "duration"),
    [
        ("avi", {"frames": 50, "duration": 99, "time_base": Fraction(1, 25), "metadata": {}}, 2),
        ("mxf", {"frames": 0, "duration": 50, "time_base": Fraction(1, 25), "metadata": {}}, 2),
        ("mov,mp4,m4a,3gp,3g2,mj2", {"frames": 9, "duration": 75, "time_base": Fraction(1, 25), "metadata": {}}, 3),
        (
            "matroska,webm",
            {"start_time": 0, "time_base": MS, "metadata": {"DURATION": "01:02:03.500000000"}},
            Fraction(7447, 2),
        ),
        (  # the first picture is stamped 1.4 s, and the length counted from 0
            "matroska,webm",
            {"start_time": 1400, "time_base": MS, "metadata": {"DURATION": "00:00:03.400000000"}},
            2,
        ),
        (  # counted from the first picture, whose stamp is a time of day
            "matroska,webm",
            {"start_time": 36_000_000, "time_base": MS, "metadata": {"DURATION": "00:00:03.400000000"}},
            Fraction(17, 5),
        ),
        ("matroska,webm", {"frames": 0, "duration": 9, "metadata": {"DURATION": "long"}}, None),
        ("mpeg", {"frames": 0, "duration": 75, "time_base": Fraction(1, 25), "metadata": {}}, None),
        ("mov,mp4,m4a,3gp,3g2,mj2", {"frames": 0, "duration": None, "metadata": {}}, None),
    ],
)
def test_a_length_that_the_header_states_is_taken_and_a_guess_is_not(kind, told, duration):
    assert stated_duration(container(kind), Thing(**told), Fraction(25)) == duration


@pytest.mark.parametrize(
    ("codec", "field_order", "interlaced", "order"),
    [
        ("h264", 1, False, "progressive"),
        ("h264", 1, True, "unknown"),
        ("h264", 2, True, "top"),
        ("h264", 3, True, "bottom"),
        ("h264", 4, True, "bottom"),
        ("h264", 5, True, "top"),
        ("h264", 0, True, "unknown"),
        ("dvvideo", 0, True, "bottom"),
        ("dvvideo", 1, False, "progressive"),
    ],
)
def test_which_field_came_first(codec, field_order, interlaced, order):
    assert flagged_order(Thing(name=codec, field_order=field_order), Thing(interlaced_frame=interlaced)) == order
