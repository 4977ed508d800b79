"""Films that vidtrack writes: what was put in comes out, at its time."""

import io
from fractions import Fraction

import av
import numpy as np
import pytest

from vidtrack.video.film import write_film


def pictures(n=6, size=(49, 65), step=Fraction(1001, 30000), start=Fraction(3)):
    for i in range(n):
        picture = np.zeros((*size, 3), np.uint8)
        picture[:, :, 0] = 40 * i
        yield start + i * step, picture


def read(file):
    file.seek(0)
    with av.open(file) as film:
        stream = film.streams.video[0]
        return [(float(f.pts * stream.time_base), f.to_ndarray(format="bgr24")) for f in film.decode(stream)], stream


def test_every_picture_comes_back_at_its_time_counted_from_the_first():
    file = io.BytesIO()
    assert write_film(file, pictures(), Fraction(30000, 1001)) == 6
    frames, stream = read(file)
    assert stream.codec_context.name in ("h264", "mpeg4")
    assert [t for t, _ in frames] == pytest.approx([i * 1001 / 30000 for i in range(6)], abs=1e-4)
    assert [float(p[:49, :65, 0].mean()) for _, p in frames] == pytest.approx([40 * i for i in range(6)], abs=6)


def test_odd_sizes_become_even_and_lose_nothing():
    file = io.BytesIO()
    write_film(file, pictures(2), Fraction(30))
    assert read(file)[0][0][1].shape == (50, 66, 3)


def test_pictures_at_one_moment_follow_each_other():
    file = io.BytesIO()
    same = [(Fraction(0), np.full((32, 32, 3), level, np.uint8)) for level in (0, 128, 255)]
    assert write_film(file, same, Fraction(25)) == 3
    times = [t for t, _ in read(file)[0]]
    assert sorted(set(times)) == times


def test_a_film_of_no_picture_is_refused():
    with pytest.raises(ValueError, match="one picture"):
        write_film(io.BytesIO(), [], Fraction(25))
