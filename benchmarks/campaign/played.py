"""What players, recorders and cutting programs leave of a film, and clips that were filmed before all was at rest."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, Scene, refilmed, run_videos
from vidtrack.video.reader import open_video

CUT = (22, 37)
"""Pictures that are cut out of one film of the run."""


def _framed(every: bool) -> Callable[[Path, Rng], None]:
    """The films, or one of them, as a screen recorder took them from a player's window: scaled, with bars about."""

    def after(folder: Path, rng: Rng) -> None:
        scale, level = float(rng.uniform(0.7, 1.4)), int(rng.choice([0, 4, 70]))
        left, top, right, bottom = (int(px) for px in rng.integers(12, 90, 4))

        def change(picture: np.ndarray) -> np.ndarray:
            how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
            shown = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=how)
            return np.pad(shown, ((top, bottom), (left, right)), constant_values=level)

        for path in run_videos(folder)[: None if every else 1]:
            refilmed(path, lambda pictures: [change(p) for p in pictures])

    return after


def _one_cut(folder: Path, rng: Rng) -> None:
    """A part cut out of one film, whose time goes on as if it were there."""
    refilmed(run_videos(folder)[0], lambda pictures: pictures[: CUT[0]] + pictures[CUT[1] :])


def _stamped_on_arrival(folder: Path, rng: Rng) -> None:
    """Pictures that were taken evenly bear the time at which a busy computer received them; no time code."""
    for path in run_videos(folder):
        with open_video(str(path)) as video:
            pictures, rate = [np.array(frame.luma) for frame in video.frames()], float(video.info.rate)
        path.unlink()
        late = np.abs(rng.normal(0, 0.005, len(pictures)))
        late[0] = 0
        stamps = np.rint(90_000 * (np.arange(len(pictures)) / rate + late)).astype(int)
        with av.open(str(path.with_suffix(".mp4")), "w") as file:
            stream = file.add_stream("libx264", rate=round(rate), options={"crf": "8"})
            stream.height, stream.width = pictures[0].shape
            stream.pix_fmt, stream.codec_context.time_base = "yuv420p", Fraction(1, 90_000)
            for picture, stamp in zip(pictures, stamps.tolist(), strict=True):
                frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuvj420p")
                frame.pts, frame.time_base = stamp, Fraction(1, 90_000)
                file.mux(stream.encode(frame))
            file.mux(stream.encode(None))


def _longer_clips(scene: Scene, rng: Rng) -> None:
    scene["calibration"]["frames"] = 20


def _frame_swings(folder: Path, rng: Rng) -> None:
    """The frame with the balls was hung a moment ago: all of them swing together, in every clip and camera."""
    px, step = float(rng.uniform(1.5, 5)), float(rng.uniform(0.2, 0.8))

    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        height, width = pictures[0].shape
        out = []
        for k, picture in enumerate(pictures):
            moved = np.array([[1, 0, px * np.sin(step * k)], [0, 1, 0.1 * px * np.cos(step * k)]])
            out.append(cv2.warpAffine(picture, moved, (width, height), borderMode=cv2.BORDER_REPLICATE))
        return out

    for path in sorted((folder / "calibration").glob("*/cam*.m*")):
        refilmed(path, change)


def _clip_panned(folder: Path, rng: Rng) -> None:
    """One camera was touched before one of its clips, and put back after it."""
    at = np.array([[1, 0, float(rng.uniform(3, 8))], [0, 1, float(rng.uniform(-6, 6))]])

    def change(picture: np.ndarray) -> np.ndarray:
        height, width = picture.shape
        return np.asarray(cv2.warpAffine(picture, at, (width, height), borderMode=cv2.BORDER_REPLICATE))

    refilmed(next((folder / "calibration/middle").glob("cam1.m*")), lambda pictures: [change(p) for p in pictures])


PLAYED: dict[str, Circumstance] = {
    "film-in-a-window": Circumstance(r"bars about", after=_framed(every=False), harmless=True),
    "all-in-a-window": Circumstance(r"bars about", after=_framed(every=True), harmless=True),
    "one-cut": Circumstance(r"ahead of the others|pictures seem to be missing|jumped", after=_one_cut),
    "stamped-on-arrival": Circumstance(r"time stamps", after=_stamped_on_arrival, harmless=True),
    "frame-swings": Circumstance(r"moves? (up to )?[0-9.]+ px rms within", _longer_clips, _frame_swings),
    "clip-panned": Circumstance(r"clip middle.* of cam1|middle: the balls of camera cam1", after=_clip_panned),
}
