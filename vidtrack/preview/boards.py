"""Whether a board is seen in a few pictures of its clips, by the stage that finds its corners."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from vidtrack.calibration.boards.board import Board
from vidtrack.errors import VidtrackError
from vidtrack.files.experiment import Experiment
from vidtrack.findings import Finding
from vidtrack.settings.config import Settings
from vidtrack.stages.board_corners import board_corners
from vidtrack.timing.frame import Frame
from vidtrack.video.random_access import Pictures
from vidtrack.workflow import boarded

PICTURES = 8
"""Pictures of each clip that are looked at, from first to last."""


class BoardSeen(NamedTuple):
    """What is said of the board, empty where it is in no picture; doubts."""

    said: str
    findings: list[Finding]


def board_in_clips(settings: Settings, experiment: Experiment, camera: str) -> BoardSeen:
    """Look for the board in each of a camera's clips of it; VidtrackError where a clip cannot be read."""
    frames: dict[str, list[Frame]] = {}
    boards, bits = {}, {}
    for clip, own in boarded.board_corners(settings, experiment, camera)["clips"].items():
        pictures = Pictures(experiment.clips[clip].videos[camera], **own.get("recording", {}))
        try:
            n = len(pictures)
            numbers = np.unique(np.linspace(0, n - 1, min(n, PICTURES)).astype(int)).tolist()
            frames[clip] = [Frame(i, Fraction(i), np.array(pictures.picture(i)), False, None) for i in numbers]
            bits[clip] = pictures.info.bits
        finally:
            pictures.close()
        boards[clip] = Board(**{**own["board"], "marker": own["board"]["marker"] or 0.0})
    looked = sum(map(len, frames.values()))
    try:
        found = board_corners(frames, boards, camera=camera, bits=bits, every=1)
    except VidtrackError as error:  # other pictures may show it: the run says
        return BoardSeen("", [Finding("doubtful", "board-not-found", problem, "") for problem in error.problems])
    doubts = [finding._replace(level="doubtful") for finding in found.findings]
    if found.table.empty:  # other pictures may show it
        return BoardSeen("", doubts)
    views = found.table.groupby(["clip", "frame"]).size()
    said = f"the board is seen in {len(views)} of {looked} pictures looked at, {views.median():.0f} corners each"
    return BoardSeen(said, doubts)
