"""Job board_corners: a camera's clips of a board in; where it saw each corner, a background and the account out."""

from __future__ import annotations

import sys
from contextlib import ExitStack

from vidtrack.calibration.boards.board import Board
from vidtrack.files.records import write_json, write_png
from vidtrack.files.tables import write_parquet
from vidtrack.stages.board_corners import board_corners, stride
from vidtrack.video.reader import open_video
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """Inputs videos (as settings["clips"]); outputs corners, picture, record."""
    camera, clips = job.settings["camera"], job.settings["clips"]
    with ExitStack() as stack:
        videos = {
            clip: stack.enter_context(open_video(path, threads=job.threads, **own.get("recording", {})))
            for (clip, own), path in zip(clips.items(), job.paths("videos"), strict=True)
        }
        done = board_corners(
            {clip: video.frames() for clip, video in videos.items()},
            {clip: Board(**{**own["board"], "marker": own["board"]["marker"] or 0.0}) for clip, own in clips.items()},
            camera=camera,
            bits={clip: video.info.bits for clip, video in videos.items()},
            every=stride(max(video.info.n_frames_hint or 0 for video in videos.values())),
        )
        pictures = {clip: video.info.shape for clip, video in videos.items()}
    for finding in done.findings:
        sys.stderr.write(f"warning: {finding.text} {finding.cure}\n")
    write_parquet(job.outputs["corners"], done.table, units="", provenance=job.provenance, columns={"sd": "px"})
    write_png(job.outputs["picture"], done.background)
    write_json(job.outputs["record"], done.record | {"pictures": pictures}, job.provenance)
