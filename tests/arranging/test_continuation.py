"""Real files, split as cameras split them: joined where their stamps run on, and only there."""

from fractions import Fraction

import av
import numpy as np
import pytest

from tests.files.clips import make_clip
from vidtrack.arranging.continuation import Facts, facts_of, goes_on, joined_where, series_among, wished_together
from vidtrack.arranging.inventory import recordings_in
from vidtrack.errors import VidtrackError


def film(path, *, n=10, code=None, first=None, created=None, codec="mpeg4", size=(64, 48)):
    path.parent.mkdir(parents=True, exist_ok=True)
    if created is None:
        stamps = None if first is None else [first + i for i in range(n)]
        make_clip(path, codec, "yuv420p", n=n, size=size, rate=Fraction(25), timecode=code, stamps=stamps)
        return
    with av.open(str(path), "w") as out:
        out.metadata["creation_time"] = created
        stream = out.add_stream(codec, rate=25)
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        for i in range(n):
            out.mux(stream.encode(av.VideoFrame.from_ndarray(np.full((72, 64), 4 * i, np.uint8), "yuv420p")))
        out.mux(stream.encode())


def parts_in(folder):
    """The parts of each recording in a folder, once what surely goes on is joined; and the unclear ones."""
    found = recordings_in(str(folder))
    series = series_among(found, lambda path: facts_of(str(folder / path)))
    whole = joined_where(found, [s.recordings for s in series if s.goes_on])
    return [list(r.parts) for r in whole], [[r.path for r in s.recordings] for s in series if s.goes_on is None]


NAMES = {
    "avchd": ["00001.MTS", "00002.MTS", "00003.MTS"],
    "dji": ["DJI_0011.MP4", "DJI_0012.MP4"],
    "dji with the time": ["DJI_20260512103000_0001_D.MP4", "DJI_20260512104000_0002_D.MP4"],
    "sony": ["C0001.MP4", "C0002.MP4"],
    "canon": ["MVI_0009.MOV", "MVI_0010.MOV"],
    "by hand": ["swim_1.mov", "swim_2.mov"],
    "nine and ten": [f"s{n}.mov" for n in (8, 9, 10, 11)],
}


@pytest.mark.parametrize("kind", [kind for kind in NAMES if kind != "avchd"])
def test_files_whose_time_code_runs_on_are_one_recording(tmp_path, kind):
    for k, name in enumerate(NAMES[kind]):
        film(tmp_path / name, n=25, code=f"10:00:{k:02d}:00")
    assert parts_in(tmp_path) == ([NAMES[kind]], [])


@pytest.mark.parametrize("kind", ["avchd", "sony", "by hand"])
def test_files_whose_stamps_run_on_are_one_recording(tmp_path, kind):
    for k, name in enumerate(NAMES[kind]):
        film(tmp_path / name, n=10, first=1000 + 10 * k, codec="libx264" if kind == "avchd" else "mpeg4")
    assert parts_in(tmp_path) == ([NAMES[kind]], [])


def test_raw_dv_whose_labels_run_on_is_one_recording(tmp_path):
    for k in range(3):
        film(tmp_path / f"tape00{k}.dv", n=25, codec="dvvideo", size=(720, 576), code=f"01:00:{k:02d}:00")
    if facts_of(str(tmp_path / "tape000.dv")).code is None:
        pytest.skip("this encoder writes no label")
    assert len(parts_in(tmp_path)[0]) == 1


def test_files_that_were_begun_when_the_one_before_ended_are_one_recording(tmp_path):
    for name, created in (("MVI_1.MOV", "00"), ("MVI_2.MOV", "02"), ("MVI_3.MOV", "04")):
        film(tmp_path / name, n=50, created=f"2026-05-12T10:30:{created}.000000Z")
    assert parts_in(tmp_path)[0] == [["MVI_1.MOV", "MVI_2.MOV", "MVI_3.MOV"]]


@pytest.mark.parametrize(
    "how",
    [
        [{"code": "10:00:00:00"}, {"code": "10:05:00:00"}],
        [{"code": "10:00:00:00"}, {"code": "10:00:00:00"}],
        [{"created": "2026-05-12T10:30:00.000000Z"}, {"created": "2026-05-12T10:37:00.000000Z"}],
        [{}, {}],
        [{"code": "10:00:00:00", "n": 25}, {"code": "10:00:01:00", "n": 25, "size": (96, 64)}],
    ],
    ids=["minutes apart", "two cameras at once", "created minutes apart", "nothing known", "another size"],
)
def test_takes_and_cameras_with_numbers_stay_recordings_of_their_own(tmp_path, how):
    for k, own in enumerate(how):
        film(tmp_path / f"swim_{k + 1}.mov", **own)
    assert parts_in(tmp_path) == ([["swim_1.mov"], ["swim_2.mov"]], [])


def test_a_name_that_says_part_and_nothing_in_the_file_is_unclear(tmp_path):
    for k in (1, 2):
        film(tmp_path / f"swim part{k}.mov")
    assert parts_in(tmp_path)[1] == [["swim part1.mov", "swim part2.mov"]]


def test_a_full_file_without_any_stamp_is_unclear():
    a = Facts(("h264",), 0.0, 700.0, 0.04, None, None, 4_293_000_000)
    assert goes_on(a, a) == (None, "")
    found = [type("R", (), {"path": p, "parts": (p,), "kind": "video"})() for p in ("DJI_0001.MP4", "DJI_0002.MP4")]
    assert [s.goes_on for s in series_among(found, lambda _: a)] == [None]
    assert series_among(found, lambda _: a._replace(size=3_000_000_000)) == []


def test_a_recording_ends_where_the_stamps_of_the_next_file_do_not_run_on(tmp_path):
    for k, code in enumerate(["10:00:00:00", "10:00:01:00", "11:00:00:00", "11:00:01:00"]):
        film(tmp_path / f"C000{k + 1}.MP4", n=25, code=code)
    names = [f"C000{k}.MP4" for k in (1, 2, 3, 4)]
    assert parts_in(tmp_path)[0] == [names[:2], names[2:]]


def test_what_a_person_wants_together_is_one_recording_for_each_camera(tmp_path):
    for camera in ("a", "b"):
        for k in (1, 2):
            film(tmp_path / f"{camera}/swim_{k}.mov", n=3)
    found = recordings_in(str(tmp_path))
    whole = joined_where(found, wished_together(found, ["swim_*.mov"]))
    assert [r.parts for r in whole] == [(f"{c}/swim_1.mov", f"{c}/swim_2.mov") for c in ("a", "b")]
    with pytest.raises(VidtrackError, match="--join dive"):
        wished_together(found, ["dive*"])
