from fractions import Fraction
from types import SimpleNamespace

import av
import numpy as np
import pytest

from benchmarks.damage import WRONG, off, scene
from tests.files.clips import make_clip
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.video.coded.bitstream import Bitstream
from vidtrack.video.coded.coded_groups import groups_of
from vidtrack.video.faults import second_look
from vidtrack.video.faults.second_look import Limits, SecondLook, _Decoded
from vidtrack.video.processes.read_apart import CAN_FORK
from vidtrack.video.reader import open_video

N = 30
KINDS = {
    "h264.mp4": ("libx264", {"g": "10", "crf": "18", "sc_threshold": "0", "bf": "2"}),
    "h264.ts": ("libx264", {"g": "10", "crf": "18", "sc_threshold": "0", "bf": "0"}),
    "cavlc.mov": ("libx264", {"g": "10", "crf": "10", "sc_threshold": "0", "x264-params": "cabac=0:slices=3"}),
    "hevc.mp4": ("libx265", {"x265-params": "log-level=none:keyint=10:min-keyint=10:bframes=2:pools=1:scenecut=0"}),
    "vp9.webm": ("libvpx-vp9", {"crf": "20", "b": "0", "g": "10", "cpu-used": "8"}),
    "av1.mkv": ("libsvtav1", {"crf": "25", "preset": "10", "g": "10"}),
    "mpeg4.avi": ("mpeg4", {"b": "2M", "bf": "2", "g": "10"}),
}


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    pictures = [scene((160, 120), deep=False)(i) for i in range(N)]

    def ready(name):
        codec, options = KINDS[name]
        if not (folder / name).exists():
            make_clip(folder / name, codec, "yuv420p", n=N, options=options, picture=pictures.__getitem__)
        return folder / name

    return ready


def packets(path):
    with av.open(str(path)) as container:
        return [(bytes(p), p.pts, p.is_keyframe) for p in container.demux(video=0) if p.size]


def with_hole(path, coded, seed=0):
    """A copy in which a few bytes of a packet, a quarter from its beginning, are others."""
    hurt = path.with_stem(f"hurt{seed}")
    place = path.read_bytes().index(coded[len(coded) // 4 :][:40]) if path.suffix != ".ts" else 0
    data = bytearray(path.read_bytes())
    data[place : place + 5] = np.random.default_rng(seed).integers(4, 256, 5, dtype=np.uint8).tobytes()
    hurt.write_bytes(data)
    return hurt


@pytest.mark.parametrize("name", KINDS)
def test_no_picture_of_a_healthy_recording_is_found(clips, name):
    every = [pts for _, pts, _ in packets(clips(name))]
    assert SecondLook(str(clips(name)), 0, 100_000).damaged(every) == set()


@pytest.mark.parametrize("name", ["h264.mp4", "hevc.mp4", "vp9.webm", "av1.mkv", "mpeg4.avi"])
def test_a_key_frame_that_ends_before_its_data_is_found_with_what_is_built_on_it(clips, name):
    """Or the decoder says that it is damaged."""
    sent = packets(clips(name))
    keys = [i for i, (_, _, key) in enumerate(sent) if key]
    found = 0
    for seed in range(3):
        hurt = with_hole(clips(name), sent[keys[1]][0], seed)
        damaged = SecondLook(str(hurt), 0, 100_000).damaged([sent[keys[1]][1]])
        expected = {pts for _, pts, _ in sent[keys[1] : keys[2]]}
        assert not damaged or expected <= damaged <= expected | {pts for _, pts, _ in sent[keys[2] :]}
        with open_video(str(hurt)) as video:
            found += bool(damaged) or any(frame.corrupt for frame in video.frames())
    assert found == 3 or name == "vp9.webm"


def silent_and_found(path, changed):
    """Of copies of a recording in which one packet is changed: how many show another picture without a word, and in how
    many of these the packet is found; changed: (number of the packet, its new bytes) of each."""
    data, sent = path.read_bytes(), packets(path)
    with open_video(str(path)) as video:
        whole = [frame.luma.astype(np.float32) for frame in video.frames()]
    silent = found = 0
    for k, other in changed:
        hurt = path.with_stem("other")
        at = data.index(sent[k][0])
        hurt.write_bytes(data[:at] + other + data[at + len(other) :])
        with open_video(str(hurt)) as video:
            frames = [(f.corrupt, f.luma.astype(np.float32)) for f in video.frames()]
        said = len(frames) != N or any(corrupt for corrupt, _ in frames)
        if not said and max(off(luma, one) for (_, luma), one in zip(frames, whole, strict=True)) > WRONG:
            silent += 1
            found += sent[k][1] in SecondLook(str(hurt), 0, 100_000).damaged([sent[k][1]])
    return silent, found


@pytest.mark.parametrize(("name", "tries", "share"), [("h264.mp4", 8, 0.9), ("hevc.mp4", 1, 0.5), ("vp9.webm", 1, 0.6)])
def test_damage_is_found_in_long_and_short_units(clips, name, tries, share):
    """Most units of HEVC and VP9 are too short for other last bytes to say anything: more of them are needed.

    Of HEVC 13 or 14 of 23, from call to call: what its decoder makes of garbage depends on memory that is not its own.
    """
    sent, rng = packets(clips(name)), np.random.default_rng(1)

    def changed():
        for k, (data, _, _) in enumerate(tries * sent):
            at = len(data) // 2
            k %= len(sent)
            if len(data) > 24:
                yield k, data[:at] + rng.integers(4, 192, 3, dtype=np.uint8).tobytes() + data[at + 3 :]

    silent, found = silent_and_found(clips(name), changed())
    assert silent >= 5
    assert found >= share * silent


@pytest.mark.parametrize(
    ("errors", "filled_in", "same", "whole"),
    [(0, True, False, True), (0, True, True, False), (1, True, False, False), (0, False, False, False)],
)
def test_in_a_taller_picture_a_whole_slice_ends_without_an_error_by_its_last_bytes(
    clips, monkeypatch, errors, filled_in, same, whole
):
    """What was garbage goes on to an error, or over all that was added, or ends by chance, whatever its last bytes."""
    seen = []

    def decoded(self, group, data, *, taller=False):
        seen.append(data)
        levels = b"" if same else bytes(len(set(seen)))
        return _Decoded(errors, filled_in, levels) if taller else _Decoded(0, False, levels)

    monkeypatch.setattr(SecondLook, "_decoded", decoded)
    look = SecondLook(str(clips("h264.ts")), 0, 100)
    look.damaged([])
    with av.open(str(clips("h264.ts"))) as container:
        group = next(groups_of(container, 0, 300, 64_000_000))
    assert look._ends_where_it_should(group, 1) is whole


def test_of_a_picture_that_the_decoder_flagged_those_built_on_it_and_shown_before_are_found(clips):
    """They come out of the decoder before it: when they did, nothing was known of damage."""
    sent = packets(clips("h264.mp4"))
    i = next(i for i in range(2, len(sent)) if sent[i][1] < sent[i - 1][1] and not sent[i - 1][2])
    reference, before = sent[i - 1][1], {pts for _, pts, _ in sent[i:] if pts < sent[i - 1][1]}
    assert before
    look = SecondLook(str(clips("h264.mp4")), 0, 100, [reference])
    assert look.damaged([min(before)]) == before
    assert look.damaged([sent[0][1]]) == set()


def test_the_most_doubtful_is_looked_at_first_and_once(clips, monkeypatch):
    looked = []
    monkeypatch.setattr(SecondLook, "_is_damaged", lambda self, look: looked.append(look.coded.pts) or False)
    sent = packets(clips("vp9.webm"))
    SecondLook(str(clips("vp9.webm")), 0, 100).damaged([sent[25][1], sent[12][1], sent[25][1]])
    keys = [sent[i][1] for i in (20, 10)]
    assert looked == [keys[0], sent[25][1], keys[1], sent[12][1]]


def test_what_is_found_does_not_depend_on_how_many_groups_are_held_at_once(clips, monkeypatch):
    sent = packets(clips("hevc.mp4"))
    keys = [i for i, (_, _, key) in enumerate(sent) if key]
    hurt, every = with_hole(clips("hevc.mp4"), sent[keys[1]][0], seed=7), [pts for _, pts, _ in sent]
    found = SecondLook(str(hurt), 0, 100_000).damaged(every)
    assert found >= {pts for _, pts, _ in sent[keys[1] : keys[2]]}
    monkeypatch.setattr("vidtrack.video.faults.second_look.LIMITS", Limits(held=0))
    assert SecondLook(str(hurt), 0, 100_000).damaged(every) == found


def test_packets_far_from_what_is_wanted_are_not_held(clips, monkeypatch):
    held = []
    monkeypatch.setattr(SecondLook, "_look_at", lambda self, groups, looked, suspects, found: held.extend(groups))
    path = clips("h264.ts")
    SecondLook(str(path), 0, 100).damaged([packets(path)[29][1]])
    assert len(held) == 3
    assert [[one.packet is not None for one in group] for group in held] == [[False] * 10, [True] * 10, [True] * 10]


@pytest.mark.parametrize("name", ["h264.mp4", "h264.ts"])
def test_of_packets_that_are_wanted_no_more_than_two_groups_are_in_memory(clips, monkeypatch, name):
    held = []
    monkeypatch.setattr(SecondLook, "_look_at", lambda self, groups, looked, suspects, found: held.extend(groups))
    every = [pts for _, pts, _ in packets(clips(name))]
    SecondLook(str(clips(name)), 0, 100).damaged(every)
    assert [len(group) for group in held] == [10, 10, 10]
    in_memory = [sum(one.packet.is_held for one in group) for group in held]
    assert in_memory[0] == 0
    assert sum(in_memory) == 0 or name == "h264.ts"


def test_where_packets_lie_changes_nothing(clips, monkeypatch):
    """Read from there each time, or all in memory."""
    found = []
    for can in (True, False):
        if not can:
            monkeypatch.setattr("vidtrack.video.coded.kept_packets.os.pread", lambda *_: b"")
            monkeypatch.setattr("vidtrack.video.coded.kept_packets.os.pwrite", lambda *_: 0)
        for name in ("h264.mp4", "hevc.mp4", "vp9.webm", "mpeg4.avi"):
            sent = packets(clips(name))
            hurt = with_hole(clips(name), sent[[i for i, one in enumerate(sent) if one[2]][1]][0], seed=7)
            found.append(SecondLook(str(hurt), 0, 100_000).damaged([pts for _, pts, _ in sent]))
    assert found[:4] == found[4:]
    assert any(found)


def test_wrong_pictures_that_no_decoder_reports_are_flagged(clips):
    """HEVC reports nothing: the last group of pictures, or the first, was wrong from beginning to end in silence."""
    sent = packets(clips("hevc.mp4"))
    keys = [i for i, (_, _, key) in enumerate(sent) if key]
    with open_video(str(clips("hevc.mp4"))) as video:
        whole = [frame.luma.astype(np.float32) for frame in video.frames()]
    wrong_before = 0
    for key in (keys[0], keys[-1]):
        with open_video(str(with_hole(clips("hevc.mp4"), sent[key][0], seed=7))) as video:
            damage = DamagedPictures(8, video.look_again)
            frames = [(f.index, f.corrupt, f.luma.astype(np.float32)) for f in damage.over(video.frames())]
            own = {index for index, corrupt, luma in frames if not corrupt and off(luma, whole[index]) > WRONG}
            assert own <= damage.indices
            assert not damage.indices & {index for index, corrupt, _ in frames if corrupt}
        wrong_before += len(own)
    assert wrong_before > 10


def test_no_more_is_decoded_for_healthy_pictures_than_is_allowed(clips, monkeypatch):
    """Every picture of a healthy recording is suspicious, as under lamps that flicker."""
    monkeypatch.setattr(
        "vidtrack.video.processes.looks_beside.CAN_FORK", False
    )  # here is counted what one process decodes
    decoded = []
    own = SecondLook._decoded
    monkeypatch.setattr(SecondLook, "_decoded", lambda self, *a, **k: decoded.append(len(a[0])) or own(self, *a, **k))
    every = [pts for _, pts, _ in packets(clips("h264.mp4"))]
    SecondLook(str(clips("h264.mp4")), 0, 5).damaged(every)
    assert 5 <= sum(decoded) < 5 + 3 * 5


@pytest.mark.parametrize(
    ("size", "compared"), [((162, 114), (176, 128)), ((160, 120), (160, 120)), ((174, 128), (174, 128))]
)
def test_what_is_coded_beside_the_picture_is_compared_too_where_the_last_macroblock_shows_little(
    tmp_path, size, compared
):
    """Of 162 x 114 px it shows four pixels: its data code what is cut off. Where it shows half, damage shows in it."""
    path = make_clip(tmp_path / "a.mp4", "libx264", "yuv420p", n=2, size=size, picture=scene(size, deep=False))
    look = SecondLook(str(path), 0, 100)
    look.damaged([])
    with av.open(str(path)) as container:
        group = next(groups_of(container, 0, 300, 64_000_000))
    assert len(look._decoded(group[:1], bytes(group[0].packet)).levels) == compared[0] * compared[1] * 3 // 2


def test_a_healthy_picture_far_from_its_key_frame_costs_little(clips, monkeypatch):
    decoded = []
    own = SecondLook._decoded
    monkeypatch.setattr(SecondLook, "_decoded", lambda self, *a, **k: decoded.append(len(a[0])) or own(self, *a, **k))
    SecondLook(str(clips("h264.ts")), 0, 100).damaged([packets(clips("h264.ts"))[9][1]])
    assert sum(decoded) <= 3 * 1 + 3 * 2  # the key frame, and the picture behind it alone


class Counted:
    """A decoder that counts the pictures that it gives."""

    given = 0

    def __init__(self, codec):
        self.__dict__["codec"] = codec

    def __getattr__(self, name):
        return getattr(self.codec, name)

    def __setattr__(self, name, value):
        setattr(self.codec, name, value)

    def decode(self, packet):
        pictures = self.codec.decode(packet)
        Counted.given += len(pictures)
        return pictures


def test_pictures_that_nothing_is_built_on_are_not_decoded_on_the_way_and_change_nothing(clips, monkeypatch):
    path = clips("h264.mp4")
    look = SecondLook(str(path), 0, 100)
    look.damaged([])
    with av.open(str(path)) as container:
        group = next(groups_of(container, 0, 300, 64_000_000))
    references = [one for one in group if look._units.bitstream.is_reference(one.data)]
    alone = next(one for one in reversed(group) if one not in references)
    assert len(group) - len(references) > 1
    data = bytes(alone.packet)
    without = look._decoded([*references, alone], data)
    own = av.CodecContext.create
    counting = SimpleNamespace(create=lambda *kind: Counted(own(*kind)))
    monkeypatch.setattr(second_look, "av", SimpleNamespace(Packet=av.Packet, error=av.error, CodecContext=counting))
    assert look._decoded([*(one for one in group if one != alone), alone], data) == without
    assert Counted.given == len(references) + 1


def test_damage_is_found_however_little_may_be_decoded_for_healthy_pictures_and_not_with_nothing(clips):
    sent = packets(clips("hevc.mp4"))
    key = [i for i, (_, _, key) in enumerate(sent) if key][-1]
    hurt = with_hole(clips("hevc.mp4"), sent[key][0], seed=7)
    assert SecondLook(str(hurt), 0, 8).damaged([sent[key][1]]) >= {pts for _, pts, _ in sent[key:]}
    assert SecondLook(str(hurt), 0, 0).damaged([sent[key][1]]) == set()


def test_a_picture_beside_which_none_is_read_to_its_end_is_let_be(clips, monkeypatch):
    """Of a recording of which no picture needs its last bytes, nothing is known."""
    monkeypatch.setattr(SecondLook, "_others", lambda self, group, place, enough: 0)
    every = [pts for _, pts, _ in packets(clips("h264.mp4"))]
    assert SecondLook(str(clips("h264.mp4")), 0, 100_000).damaged(every) == set()


def test_far_from_a_key_frame_nothing_is_looked_at(clips, monkeypatch):
    monkeypatch.setattr("vidtrack.video.faults.second_look.LIMITS", Limits(far=1))
    sent = packets(clips("hevc.mp4"))
    key = [i for i, (_, _, key) in enumerate(sent) if key][-1]
    hurt = with_hole(clips("hevc.mp4"), sent[key][0], seed=7)
    assert SecondLook(str(hurt), 0, 100).damaged([sent[key + 1][1]]) >= {pts for _, pts, _ in sent[key:]}
    monkeypatch.setattr("vidtrack.video.faults.second_look.LIMITS", Limits(far=0))
    assert SecondLook(str(hurt), 0, 100).damaged([sent[key + 1][1]]) == set()


def test_codecs_that_are_not_read_serially_to_their_last_bytes_are_let_be(tmp_path):
    path = make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=4)
    assert SecondLook(str(path), 0, 100).damaged([0, 1, 2, 3]) == set()


def test_units_lie_where_their_lengths_or_start_codes_say():
    counted = Bitstream("h264", bytes([1, 0, 0, 0, 0xFF]))
    assert counted.places(b"\0\0\0\2ab\0\0\0\1c\0\0\0\x09d") == [(4, 6), (10, 11)]
    assert Bitstream("h264", None).places(b"\0\0\0\1ab\0\0\1c") == [(4, 6), (9, 10)]


def test_frames_are_named_by_their_numbers_where_time_does_not_begin_at_zero(tmp_path, clips):
    path = make_clip(
        tmp_path / "late.mkv",
        "libx265",
        "yuv420p",
        n=N,
        options=KINDS["hevc.mp4"][1],
        picture=scene((160, 120), deep=False),
        stamps=range(50, 50 + N),
        stamp_base=Fraction(1, 25),
        rate=Fraction(25),
    )
    sent = packets(path)
    key = [i for i, (_, _, key) in enumerate(sent) if key][1]
    with open_video(str(with_hole(path, sent[key][0], seed=7))) as video:
        frames = [frame.index for frame in video.frames()]
        found = video.look_again([10])
    assert found == set() or min(found) == 10
    assert found <= set(frames)


def test_in_an_avi_pictures_are_named_by_their_packets_though_these_do_not_say_when_they_are_shown(
    tmp_path, monkeypatch
):
    codec, options = KINDS["h264.mp4"]
    picture = scene((160, 120), deep=False)
    path = make_clip(tmp_path / "a.avi", codec, "yuv420p", n=9, options=options, picture=picture)
    asked = []
    monkeypatch.setattr(SecondLook, "damaged", lambda self, suspects: asked.extend(suspects) or {*suspects, -1})
    with open_video(str(path)) as video:
        frames = list(video.frames())
        assert video.look_again([3]) == {3}
    assert asked == [packets(path)[frames[3].coded.number][1]]
    assert frames[3].coded.number == 1  # P, before the two B that are shown before it


def test_a_recording_in_several_files_is_looked_at_in_the_file_that_is_damaged(tmp_path, clips):
    sent = packets(clips("hevc.mp4"))
    key = [i for i, (_, _, key) in enumerate(sent) if key][1]
    hurt = with_hole(clips("hevc.mp4"), sent[key][0], seed=7)
    (tmp_path / "b.mp4").write_bytes(hurt.read_bytes())
    (tmp_path / "a.mp4").write_bytes(clips("hevc.mp4").read_bytes())
    with open_video(str(tmp_path / "b.mp4")) as video:
        assert sum(1 for _ in video.frames()) == N
        alone = video.look_again([10])
    assert 10 in alone
    with open_video(str(tmp_path / "a.mp4"), parts=["b.mp4"]) as video:
        assert sum(1 for _ in video.frames()) == 2 * N
        assert video.look_again([10, N + 10]) == {N + index for index in alone}


def test_another_process_that_looks_too_changes_nothing_however_many_pictures_may_be_decoded(clips, monkeypatch):
    sent = packets(clips("hevc.mp4"))
    key = [i for i, (_, _, key) in enumerate(sent) if key][1]
    hurt = with_hole(clips("hevc.mp4"), sent[key][0], seed=7)
    every = np.random.default_rng(1).permutation([pts for _, pts, _ in sent]).tolist()
    for path in (clips("hevc.mp4"), hurt):
        for most in (3, 20, 60, 10_000):
            left, found = [], []
            for can_fork in (True, False):
                monkeypatch.setattr("vidtrack.video.processes.looks_beside.CAN_FORK", can_fork)
                look = SecondLook(str(path), 0, most)
                found.append(look.damaged(every))
                left.append(look._left)
            assert found[0] == found[1]
            assert left[0] == left[1]
    assert found[0]


@pytest.mark.skipif(not CAN_FORK, reason="processes are not forked here")
def test_half_of_the_looks_at_healthy_pictures_are_done_by_another_process(clips, monkeypatch):
    own, looked = SecondLook._is_damaged, []
    monkeypatch.setattr(SecondLook, "_is_damaged", lambda self, look: looked.append(1) or own(self, look))
    every = [pts for _, pts, _ in packets(clips("h264.mp4"))]
    SecondLook(str(clips("h264.mp4")), 0, 100_000).damaged(every)
    assert len(looked) == N // 2
