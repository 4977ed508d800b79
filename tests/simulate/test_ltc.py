from fractions import Fraction

import numpy as np
import pytest

from tests.timing import libltc
from vidtrack.simulate.ltc import ltc_signal, words
from vidtrack.timing.timecode import Timecode, parse

WITNESS = libltc.load()


def test_a_word_is_what_the_standard_says_bit_by_bit():
    code = parse("23:59:58;27", Fraction(30000, 1001))
    bits = "".join(map(str, words(code.frame, code)))
    # frames 27, seconds 58, minutes 59, hours 23: units then tens, each least significant bit first
    assert bits[0:4] + bits[8:10] == "1110" + "01"
    assert bits[10] == "1"  # drop-frame
    assert bits[16:20] + bits[24:27] == "0001" + "101"
    assert bits[32:36] + bits[40:43] == "1001" + "101"
    assert bits[48:52] + bits[56:58] == "1100" + "01"
    assert bits[64:] == "0011111111111101"


@pytest.mark.parametrize(("rate", "polarity"), [(30, 27), (25, 59), (24, 27)])
def test_the_polarity_bit_makes_the_zeros_of_every_word_even(rate, polarity):
    code = Timecode(0, Fraction(rate))
    bits = words(np.arange(500), code)
    assert not ((bits == 0).sum(-1) % 2).any()
    assert 0 < bits[:, polarity].mean() < 1


def test_user_bits_fill_their_eight_groups():
    bits = words(0, Timecode(0, Fraction(25)), user_bits=0x12345678)
    groups = [int("".join(map(str, bits[4 + 8 * k : 8 + 8 * k][::-1])), 2) for k in range(8)]
    assert groups == [8, 7, 6, 5, 4, 3, 2, 1]


def test_every_word_begins_with_a_turn_where_it_should():
    first = parse("10:00:00:00", Fraction(25))
    fs = 1_000_000
    t = np.arange(int(0.2 * fs)) / fs
    signal = ltc_signal(t, first, start=0.0123456)
    for k in range(4):
        at = 0.0123456 + k / 25
        before, after = np.interp([at - 60e-6, at + 60e-6], t, signal)
        assert before * after < 0
        assert np.interp(at, t, signal) == pytest.approx(0, abs=0.02)


@pytest.mark.skipif(WITNESS is None, reason="libltc11 is not installed")
@pytest.mark.parametrize(
    ("text", "rate"), [("09:59:58:20", "25"), ("10:00:58;20", "30000/1001"), ("23:59:58:20", "24")]
)
def test_libltc_reads_what_we_write(text, rate):
    first = parse(text, Fraction(rate))
    fs = 48_000
    signal = ltc_signal(np.arange(4 * fs) / fs, first, level=0.7)
    found = libltc.decode(WITNESS, signal, fs / float(first.rate))
    assert len(found) >= 3.8 * float(first.rate)
    for (h, m, s, f, drop), at in found:
        code = parse(f"{h:02d}:{m:02d}:{s:02d}:{f:02d}", first.rate, drop)
        behind = (at / fs) * float(first.rate) + first.frame - code.frame
        behind = (behind + 12 * 3600 * float(first.rate)) % (24 * 3600 * round(first.rate)) - 12 * 3600 * float(
            first.rate
        )
        assert abs(behind) < 0.01
        assert drop == first.drop
