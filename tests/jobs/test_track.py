"""The track job on a clip of faint targets: what it writes agrees with itself."""

import subprocess
import sys
import weakref
from fractions import Fraction

import av
import numpy as np
import pandas as pd
import pytest

from benchmarks.damage import scene
from tests.discs import picture
from tests.files.clips import make_clip
from tests.video.faults.test_second_look import KINDS, packets, with_hole
from tests.video.times.test_makers_readout import atom, header
from vidtrack.files.records import read_json
from vidtrack.files.tables import write_parquet
from vidtrack.jobs import track
from vidtrack.jobs.track import run
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.tracking.tag_reading.coded_tags import FoundTags, TagFinder
from vidtrack.video.decoded import DecodedVideo
from vidtrack.video.monitored import SPARE
from vidtrack.video.processes.read_apart import CAN_FORK
from vidtrack.workflow.job import Job

TAGS = {"tags": {"family": "36h11", "ids": None, "named": []}, "detect": {"fields": "frame"}}


def write_clip(path, contrast, k=40, codec="ffv1"):
    """A ball of so few grey levels, in which the reader sees nothing but an even picture."""
    rng = np.random.default_rng(0)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=Fraction(30))
        stream.width, stream.height, stream.pix_fmt = 160, 120, "gray"
        for i in range(k):
            luma = picture((120, 160), [(40 + 2 * i, 60, 4.0)], level=40, contrast=contrast, noise=0.5, rng=rng)
            frame = av.VideoFrame.from_ndarray(luma, format="gray")
            frame.pts, frame.time_base = i, Fraction(1, 30)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def tracked(folder, contrast, clip=None, **more):
    if clip is None:
        write_clip(clip := folder / "cam1.mkv", contrast)
    outputs = {name: folder / f"{name}.parquet" for name in ("centroids", "tracklets", "light", "background")}
    outputs |= {"record": folder / "record.json", "picture": folder / "background.png"}
    settings = {"run": "r", "camera": "cam1", "targets": 1, "detect": {}} | more
    run(Job(settings=settings, inputs={"video": [clip], "targets": []}, outputs=outputs, threads=1, provenance={}))
    return read_json(outputs["record"]), pd.read_parquet(outputs["tracklets"])


def test_no_recording_in_which_targets_are_measured_is_called_blank(tmp_path):
    record, tracklets = tracked(tmp_path, 8)
    assert record["measured"] == 1
    assert not any("blank" in line for line in record["reading"]["problems"])
    assert record["findings"] == []
    assert tracklets["tracklet"].tolist() == [0] * 40


def test_a_recording_that_shows_nothing_is_called_so(tmp_path):
    record, tracklets = tracked(tmp_path, 0)
    assert record["measured"] == 0
    assert any("blank" in line for line in record["reading"]["problems"])
    assert [finding["code"] for finding in record["findings"]] == ["target-never-measured", "reading"]
    assert not len(tracklets)


def test_the_read_out_that_the_maker_wrote_into_the_film_is_recorded(tmp_path):
    write_clip(clip := tmp_path / "cam1.mov", 30, k=8, codec="png")
    with clip.open("ab") as file:
        file.write(atom(b"moov", atom(b"udta", atom(b"GPMF", header(20.5)))))
    record, _ = tracked(tmp_path, 30, clip)
    assert record["video"]["readout"]["ms"] == 20.5
    assert record["reading"]["frames"] == 8


def test_a_table_that_is_written_is_given_up_before_the_next_one_is(tmp_path, monkeypatch):
    """Those of two hours take 90 MB each."""
    alive, written = [], []

    def monitored(path, table, **more):
        alive.append(sum(one() is not None for one in written))
        written.append(weakref.ref(table))
        write_parquet(path, table, **more)

    monkeypatch.setattr(track, "write_parquet", monitored)
    tracked(tmp_path, 30)
    assert alive == [0] * 4


@pytest.mark.skipif(not CAN_FORK, reason="there is no fork here")
@pytest.mark.parametrize(("how", "apart"), [({}, 1), ({"detect": {"end": 28}}, 0)])
def test_the_same_is_written_whichever_process_looks_for_damaged_pictures(tmp_path, monkeypatch, how, apart):
    """Where a part of the recording is used, the process that follows targets does: the other one reads all."""
    elsewhere, began = DamagedPictures.elsewhere, []
    monkeypatch.setattr(DamagedPictures, "elsewhere", lambda self: began.append(elsewhere(self)))
    whole = make_clip(tmp_path / "cam1.mov", "mpeg2video", "yuv420p", n=30, picture=scene((160, 120), deep=False))
    clip = with_hole(whole, packets(whole)[17][0], seed=3)
    there = tracked(tmp_path, 0, clip, **how)
    assert len(began) == apart
    monkeypatch.setitem(SPARE, "mpeg2video", 2)
    here = tracked(tmp_path, 0, clip, **how)
    assert len(began) == apart
    assert there[0] == here[0]
    pd.testing.assert_frame_equal(there[1], here[1])
    assert here[0]["reading"]["corrupt"] > 0


def test_what_tracks_targets_is_there_without_scipy():
    """Its import takes 0.3 s and 13 MB, and a recording without tags needs none of it."""
    code = "import sys, vidtrack.jobs.track; print(any(name.partition('.')[0] == 'scipy' for name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    "how", [{}, TAGS | {"targets": 0}, TAGS | {"detect": {"fields": "frame", "start": 2, "end": 28}}]
)
def test_nothing_is_measured_in_pictures_that_a_second_look_finds_damaged(tmp_path, monkeypatch, how):
    """The last group of pictures is wrong from its key frame to the end of the recording, and HEVC reports nothing.

    It is taken once, at the end of what is used; with tags, pictures are looked at before these are painted over.
    """
    monkeypatch.setattr(TagFinder, "found", lambda self, picture: FoundTags(np.zeros(0, int), np.zeros((0, 4, 2))))
    looks, own = [], DecodedVideo.look_again
    monkeypatch.setattr(DecodedVideo, "look_again", lambda self, at: looks.append(at) or own(self, at))
    codec, options = KINDS["hevc.mp4"]
    whole = make_clip(
        tmp_path / "cam1.mp4", codec, "yuv420p", n=30, options=options, picture=scene((160, 120), deep=False)
    )
    sent = packets(whole)
    key = [i for i, (_, _, key) in enumerate(sent) if key][-1]
    record, tracklets = tracked(tmp_path, 0, with_hole(whole, sent[key][0], seed=7), **how)
    assert len(looks) == 1
    last = how.get("detect", {}).get("end", 29)
    assert set(record["damage_seen"]) >= set(range(20, last + 1))
    assert not len(tracklets) or tracklets["frame"].max() < 20
    assert "damage-seen" in [finding["code"] for finding in record["findings"]]


@pytest.mark.parametrize(("wide", "bars"), [((0, 0), None), ((30, 24), [24, 30, 24, 30])])
def test_the_bars_about_a_film_are_in_its_record(tmp_path, wide, bars):
    rng = np.random.default_rng(0)
    with av.open(str(clip := tmp_path / "cam1.mkv"), "w") as container:
        stream = container.add_stream("ffv1", rate=Fraction(30))
        stream.height, stream.width, stream.pix_fmt = 120 + 2 * wide[0], 160 + 2 * wide[1], "gray"
        for i in range(20):
            luma = picture((120, 160), [(40 + 2 * i, 60, 4.0)], level=40, contrast=90, noise=1.0, rng=rng)
            luma = np.pad(luma, ((wide[0],) * 2, (wide[1],) * 2))
            frame = av.VideoFrame.from_ndarray(luma, format="gray")
            frame.pts, frame.time_base = i, Fraction(1, 30)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    record, _ = tracked(tmp_path, 0, clip)
    assert record["video"].get("bars") == bars
