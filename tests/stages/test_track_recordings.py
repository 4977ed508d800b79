"""Every kind of recording, through the stage that tracks: centroids are where the ball was drawn, at their times."""

import os
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from tests.files.clips import ball, make_clip, video_frame
from tests.video import test_colour
from tests.video.pictures import cine, ser, tiff, write_mraw
from vidtrack.files.experiment import look_through
from vidtrack.preview.views import opened_with
from vidtrack.settings.config import settings_from_config
from vidtrack.stages.track import track
from vidtrack.video.reader import open_video

N, SIZE, RATE = 16, (120, 90), 50


def place(i):
    return 30.3 + 2.37 * i, 44.2 + 0.41 * i


def levels(i, bits=8, size=SIZE):
    noise = np.random.default_rng(i).normal(0, 1.0, size[::-1])
    picture = np.clip(ball(*size, *place(i)) + noise, 0, 255) * (2**bits - 1) / 255
    return np.rint(picture).astype(np.uint8 if bits == 8 else np.uint16)


def numbered(ending, bits):
    def write(folder):
        for i in range(N):
            cv2.imwrite(str(folder / f"shot{i + 1}.{ending}"), levels(i, bits))
        return folder / f"shot1.{ending}", {"numbered": True, "rate": RATE}

    return write


def pages(bits):
    def write(folder):
        (folder / "a.tif").write_bytes(tiff([levels(i, bits) for i in range(N)]))
        return folder / "a.tif", {"rate": RATE}

    return write


def clip(name, codec, pix_fmt, *, bits=8, size=SIZE, options=None, stated=RATE, **how):
    def write(folder):
        make_clip(
            folder / name, codec, pix_fmt, n=N, size=size, rate=Fraction(stated), options=options or {},
            picture=lambda i: levels(i, bits, size),
        )  # fmt: skip
        return folder / name, how

    return write


def chapters(folder):
    names = [f"GX0{k + 1}0007.MP4" for k in range(2)]
    for k, name in enumerate(names):
        make_clip(
            folder / name, "libx264", "yuv420p", n=N // 2, size=SIZE, rate=Fraction(RATE), options={"qp": "4"},
            picture=lambda i, k=k: levels(N // 2 * k + i),
        )  # fmt: skip
    return folder / names[0], {"parts": names[1:]}


def gif(folder):
    with av.open(str(folder / "a.gif"), "w") as out:
        stream = out.add_stream("gif", rate=Fraction(RATE))
        stream.width, stream.height, stream.pix_fmt = *SIZE, "gray"
        for i in range(N):
            frame = video_frame(levels(i), "gray")
            frame.pts, frame.time_base = i, Fraction(1, RATE)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return folder / "a.gif", {}


def second_stream(folder):
    with av.open(str(folder / "a.mkv"), "w") as out:
        streams = [out.add_stream("ffv1", rate=Fraction(RATE)) for _ in range(2)]
        for stream in streams:
            stream.width, stream.height, stream.pix_fmt = *SIZE, "gray"
        for i in range(N):
            for stream, luma in zip(streams, (np.full(SIZE[::-1], 60, np.uint8), levels(i)), strict=True):
                frame = video_frame(luma, "gray")
                frame.pts, frame.time_base = i, Fraction(1, RATE)
                out.mux(stream.encode(frame))
        for stream in streams:
            out.mux(stream.encode())
    return folder / "a.mkv", {"stream": 2}


def high_speed(name):
    def write(folder):
        times, path = [i / RATE for i in range(N)], folder / name
        if name.endswith("cine"):
            path.write_bytes(cine_of(times))
        elif name.endswith("ser"):
            path.write_bytes(ser_of(times))
        return path, {}

    return write


def with_levels(writer):
    """A writer of tests/video/pictures with the pictures of this module."""

    def write(*given, **named):
        from tests.video import pictures

        kept, pictures.levels = pictures.levels, levels
        try:
            return writer(*given, **named)
        finally:
            pictures.levels = kept

    return write


cine_of, ser_of = with_levels(cine), with_levels(ser)


def mraw(folder):
    with_levels(write_mraw)(folder / "cam1.mraw", N, stored=12, effective=12, rate=RATE)
    return folder / "cam1.mraw", {}


KINDS = {
    "png": numbered("png", 8),
    "png 16 bit": numbered("png", 16),
    "tiff": numbered("tif", 8),
    "tiff 16 bit": numbered("tif", 16),
    "pages": pages(8),
    "pages 16 bit": pages(16),
    "chapters": chapters,
    "gif": gif,
    "stream": second_stream,
    "cine": high_speed("a.cine"),
    "ser": high_speed("a.ser"),
    "mraw": mraw,
    "slow motion": clip("a.mp4", "libx264", "yuv420p", options={"qp": "4"}, stated=25, rate=RATE),
    "odd sizes, full range": clip("a.avi", "mjpeg", "yuvj420p", size=(121, 91), options={"qmin": "1", "qmax": "1"}),
    "alpha": clip("a.mkv", "ffv1", "yuva420p"),
    "10 bit": clip("a.mkv", "ffv1", "yuv420p10le", bits=10),
    "12 bit": clip("a.mkv", "ffv1", "gray12le", bits=12),
}


def centroids(path, how):
    with open_video(str(path), **how) as video:
        return track(video.frames(), video.info, targets=1).centroids


def check(table, where, within):
    seen = table[table["Xf"].notna()]
    assert len(seen) >= N - 2
    for _, row in seen.iterrows():
        i = int(row["frame"])
        assert row["time_s"] == pytest.approx(i / RATE, abs=1e-4)
        assert abs(row["Xf"] - where(i)[0]) < within
        assert abs(row["Yf"] - where(i)[1]) < within
    assert np.median(np.abs(seen["Xf"] - [where(int(i))[0] for i in seen["frame"]])) < 0.05


@pytest.mark.parametrize("kind", KINDS)
def test_centroids_of_every_kind_of_recording_are_where_the_ball_was_drawn(tmp_path, kind):
    path, how = KINDS[kind](tmp_path)
    check(centroids(path, how), place, 0.15)  # sd 0.02 px; GIF and H.264 round levels


ELSEWHERE = {
    "file": (clip("a.mkv", "ffv1", "gray"), "../far/a.mkv"),
    "files": (chapters, ["../far/GX010007.MP4", "../far/GX020007.MP4"]),
    "folder": (numbered("png", 8), "../far"),
    "pattern": (numbered("tif", 16), "../far/shot*.tif"),
}


def centroids_of(config):
    """Centroids of cam1 in the one run of the current folder, its recording opened as the workflow opens it."""
    settings = settings_from_config({"units": "in", **config})
    experiment, problems = look_through(settings)
    assert problems == []
    ((name, run),) = experiment.runs.items()
    return centroids(run.videos["cam1"], opened_with(settings, experiment, "run", name, "cam1"))


@pytest.mark.parametrize("kind", ELSEWHERE)
def test_a_recording_that_the_config_names_elsewhere_is_measured_there(tmp_path, monkeypatch, kind):
    write, path = ELSEWHERE[kind]
    for name in ("far", "lab"):
        (tmp_path / name).mkdir()
    write(tmp_path / "far")
    monkeypatch.chdir(tmp_path / "lab")
    run = {"videos": {"cam1": path}, **({} if kind in ("file", "files") else {"rate": RATE})}
    check(centroids_of({"cameras": {"cam1": {}}, "runs": {"swim": run}}), place, 0.15)


@pytest.mark.parametrize(("camera", "run"), [(RATE, None), (None, RATE), (10, RATE)])
def test_the_rate_of_a_camera_or_of_a_run_stretches_the_times_and_the_run_s_counts(tmp_path, monkeypatch, camera, run):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs/swim").mkdir(parents=True)
    os.rename(clip("a.mkv", "ffv1", "gray", stated=25)(tmp_path)[0], tmp_path / "runs/swim/cam1.mkv")
    given = [{} if rate is None else {"rate": rate} for rate in (camera, run)]
    check(centroids_of({"cameras": {"cam1": given[0]}, "runs": {"swim": given[1]}}), place, 0.15)


def film_in_colour(path):
    """A red ball on a green of its luma, FFV1."""
    with av.open(str(path), "w") as out:
        stream = out.add_stream("ffv1", rate=Fraction(RATE))
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for i in range(N):
            frame = test_colour.frame_of(i, "yuv420p", "420 left")
            frame.pts, frame.time_base = i, Fraction(1, RATE)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())


def test_by_colour_a_red_ball_on_green_of_equal_luma_is_tracked(tmp_path):
    path = tmp_path / "a.mkv"
    film_in_colour(path)
    check(centroids(path, {"colour": {"hue": 0.0, "width": 120.0}}), test_colour.place, 0.05)


def test_files_beside_a_recording_are_known_for_what_they_are(tmp_path):
    from vidtrack.arranging.inventory import recordings_in
    from vidtrack.files.recordings import recordings_in as of_cameras

    path, _ = KINDS["slow motion"](tmp_path)
    os.rename(path, tmp_path / "cam1.mp4")
    for name in ("cam1.THM", "cam1.LRV", "cam1.SRT", "cam1.XML", "cam1.cih", "Thumbs.db", ".DS_Store", "cam1.xmp"):
        (tmp_path / name).write_bytes(b"x")
    problems = []
    assert {c: r.path for c, r in of_cameras(str(tmp_path), ["cam1"], problems).items()} == {
        "cam1": str(tmp_path / "cam1.mp4")
    }
    assert problems == []
    assert [r.path for r in recordings_in(str(tmp_path))] == ["cam1.mp4"]
