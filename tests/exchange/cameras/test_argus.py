import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.argus import looks_like_profiles, read_profiles

LINE = "{} 800.5 1280 720 639.5 359.5 1.01 -0.1 0.02 0.001 -0.002 0.003\n"


@pytest.mark.parametrize("separator", [" ", ","])
def test_a_profile_has_a_camera_a_line(tmp_path, separator):
    path = tmp_path / "profile.txt"
    path.write_text((LINE.format(1) + LINE.format(2)).replace(" ", separator))
    first, second = read_profiles(path)
    assert looks_like_profiles(path)
    assert (first.number, second.number) == (1, 2)
    assert first.lens.fy == pytest.approx(800.5 * 1.01)
    assert (first.lens.k, first.lens.p1, first.lens.p2) == ((-0.1, 0.02, 0.003), 0.001, -0.002)
    assert first.lens.image_size == (1280, 720)


def test_a_library_of_lenses_has_names_of_shooting_modes(tmp_path):
    path = tmp_path / "GoPro.csv"
    path.write_text(
        "Shooting mode,f,w,h,cx,cy,a,k1,k2,t1,t2,k3\n"
        + LINE.format("2.7K 60fps").replace(" ", ",").replace("2.7K,", "2.7K ")
    )
    assert [each.name for each in read_profiles(path)] == ["2.7K 60fps"]
    path.write_text(path.read_text().replace("k3\n", "k3,End\n").replace("0.003\n", "0.003,0\n"))
    assert [each.name for each in read_profiles(path)] == ["2.7K 60fps"]
    assert not looks_like_profiles(path)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("1 2 3\n", "3 numbers"),
        (LINE.format(1).strip() + " 1 2\n", "omnidirectional"),
        # a library's mode of twelve cells whose last is xi of an omnidirectional lens, no k3
        (LINE.format("2.7k-wide (CMei)").replace(" ", ",").replace("wide,(", "wide ("), "omnidirectional"),
        ("", "empty"),
    ],
)
def test_what_is_no_profile_is_refused_in_one_line(tmp_path, text, what):
    (tmp_path / "p.txt").write_text(text)
    with pytest.raises(VidtrackError, match=what):
        read_profiles(tmp_path / "p.txt")
