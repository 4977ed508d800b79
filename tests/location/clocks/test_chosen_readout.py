"""Which read-out of a camera is used, and what is said of it."""

import pytest

from vidtrack.location.clocks.chosen_readout import chosen_readouts

STATED = {"ms": 20.6, "source": "GoPro's SROT, HERO11 Black", "doubt": "", "steady": True}


def video(**readout):
    return {"width": 640, "height": 480, "rotation": 180, "mirrored": True} | (
        {"readout": STATED | readout} if readout else {}
    )


def chosen(said=None, by_motion=True, **readout):
    found = chosen_readouts({"cam1": video(**readout)}, {} if said is None else {"cam1": said}, by_motion=by_motion)
    return found.readouts["cam1"], [(f.level, f.code) for f in found.findings]


def test_a_camera_of_which_nothing_is_known_reads_all_rows_at_once():
    readout, said = chosen()
    assert readout == (0.0, (640, 480), 180, True)
    assert said == []


def test_what_the_config_says_is_in_ms():
    assert chosen(20.0) == ((0.02, (640, 480), 180, True), [])


def test_what_the_maker_says_is_used_where_the_config_says_nothing():
    readout, said = chosen(ms=20.6)
    assert readout.seconds == pytest.approx(0.0206)
    assert said == [("note", "readout-of-maker")]


@pytest.mark.parametrize(("own", "told"), [(12.0, True), (0.0, True), (20.0, False), (-20.0, False), (22.9, True)])
def test_the_config_wins_and_is_compared_with_the_maker(own, told):
    readout, said = chosen(own, ms=20.6)
    assert readout.seconds == own / 1e3
    assert said == ([("doubtful", "readout-disagrees")] if told else [])


def test_a_doubtful_number_of_the_maker_is_not_used():
    readout, said = chosen(ms=20.6, doubt="no camera reads a picture so")
    assert readout.seconds == 0
    assert said == [("note", "readout-not-used")]


def test_a_stabiliser_is_told():
    assert chosen(ms=20.6, steady=False)[1] == [("note", "readout-of-maker"), ("note", "stabiliser-on")]


def test_where_the_motion_cannot_show_it_the_makers_is_used_and_it_is_told():
    assert chosen("motion", ms=20.6)[0].seconds == 0  # sought from none on
    readout, said = chosen("motion", by_motion=False, ms=20.6)
    assert readout.seconds == pytest.approx(0.0206)
    assert said == [("doubtful", "readout-unsure")]
