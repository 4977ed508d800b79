"""Job overlay_film: a recording and what was found in it -> results/runs/<run>/overlay_<camera>.mp4 and its poster."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.figures.overlay_film import Painter
from vidtrack.files.atomic import replacing
from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.geometry.picture_part import Picture, picture_from_record
from vidtrack.location.cameras.run_pictures import Pictures, camera_shown, windows
from vidtrack.progress import Progress
from vidtrack.stages.overlay_film import Mark, names_of_tracks, overlay_marks, targets_of
from vidtrack.timing.clock import Clock
from vidtrack.timing.clock_text import readable
from vidtrack.video.film import write_film
from vidtrack.video.reader import open_video
from vidtrack.workflow.job import Job

if TYPE_CHECKING:
    from vidtrack.geometry.camera import Camera
    from vidtrack.video.recording import Video


def run(job: Job) -> None:
    """inputs: video, centroids, reading (centroids/<camera>.json), trajectories, record (locate.json); mode space also
    camera and labelling. outputs: film, poster.

    settings: run, camera, crop, recording (see stage track).
    """
    order, camera = job.settings, str(job.settings["camera"])
    centroids, located = read_parquet(job.path("centroids")), read_json(job.path("record"))
    if centroids.empty:
        where = f"runs.{order['run']}: {camera}"
        raise VidtrackError(f"{where}: no frame was followed, so there is nothing to draw. See the run's verdict.")
    clock = (located.get("clocks", {}).get("cameras") or {}).get(camera) or {}
    marks = overlay_marks(
        centroids,
        read_parquet(job.path("trajectories")),
        _camera(job),
        clock=Clock(clock.get("offset_s") or 0.0, clock.get("rate_ppm") or 0.0),
        shift_s=(located.get("time", {}).get("shift_s") or {}).get(camera) or 0.0,
    )
    times = centroids.groupby("frame")["time_s"].min()
    first, last = int(times.index.min()), int(times.index.max())
    poster: list[Any] = []
    with open_video(job.path("video"), threads=job.threads, **order.get("recording", {})) as video:
        painter = Painter(targets_of(marks), names_of_tracks(located, camera), camera, video.info.bits)
        label = f"{order['run']}/{camera}"
        pictures = _pictures(video, painter, marks, dict(times.items()), (first, last), poster, label)
        _write(job.outputs["film"], pictures, video, f"runs.{order['run']}: {camera}")
    import cv2

    with replacing(job.outputs["poster"]) as file:
        file.write(cv2.imencode(".jpg", poster[0], [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes())


def _camera(job: Job) -> Camera | None:
    """The camera as the run's pictures have it; None where the run is located without one."""
    if not job.paths("camera"):
        return None
    own, name = read_camera(job.path("camera")).camera, str(job.settings["camera"])
    known = read_json(job.path("labelling")).get("pictures")
    run = read_json(job.path("reading")).get("video")
    calibrated = picture_from_record(next(iter(known.values()))) if known else Picture(*own.image_size)
    if not run:
        return own
    pictures = {name: Pictures(calibrated, picture_from_record(run), job.settings.get("crop"))}
    part = windows(pictures, f"runs.{job.settings['run']}")[0].get(name)
    return camera_shown(own, None, part)[0]


def _pictures(
    video: Video,
    painter: Painter,
    marks: dict[int, list[Mark]],
    times: dict[Any, float],
    ends: tuple[int, int],
    poster: list[Any],
    label: str,
) -> Iterator[tuple[Fraction, Any]]:
    """Each frame that was followed, with its marks; the poster is the one in the middle."""
    first, last = ends
    with Progress(f"overlay {label}", last - first + 1, "frames") as progress:
        for frame in progress.over(video.frames(ahead=True)):
            if frame.index < first:
                continue
            if frame.index > last:
                break
            when = times.get(frame.index, float("nan"))
            text = f"frame {frame.index}" + (f"  {readable(when, 3)}" if np.isfinite(when) else "")
            picture = painter.painted(frame.luma, marks.get(frame.index, []), text)
            if frame.index >= (first + last) // 2 and not poster:
                poster.append(picture)
            yield frame.time, picture


def _write(path: str, pictures: Iterator[tuple[Fraction, Any]], video: Video, where: str) -> None:
    """The film, whole or not at all."""
    head = next(pictures, None)
    if head is None:
        text = f"{where}: the recording has none of the frames that were followed. Follow its targets again."
        raise VidtrackError(text)
    info = video.info
    with replacing(path) as file:
        write_film(file, chain([head], pictures), info.rate, sample_aspect=info.sample_aspect)
