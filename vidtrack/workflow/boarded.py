"""The settings of the rules that find and use a board, as `orders` has those of the others."""

from __future__ import annotations

from vidtrack.errors import VidtrackError
from vidtrack.files.experiment import Experiment, board_of
from vidtrack.settings.config import Settings
from vidtrack.workflow.orders import clips_of, lens_of
from vidtrack.workflow.own_settings import Order, recording_of


def board_clips(settings: Settings, experiment: Experiment, camera: str) -> list[str]:
    """A camera's clips of a board."""
    here = [n for n, c in experiment.clips.items() if camera in c.videos]
    return [name for name in here if board_of(settings, experiment, name) is not None]


def board_corners(settings: Settings, experiment: Experiment, camera: str) -> Order:
    """Which board each of a camera's clips shows."""
    return {
        "camera": camera,
        "clips": {
            name: {
                "board": _board(settings, experiment, name),
                "recording": recording_of(settings, experiment.clips[name], camera),
            }
            for name in board_clips(settings, experiment, camera)
        },
    }


def _board(settings: Settings, experiment: Experiment, clip: str) -> Order:
    board = board_of(settings, experiment, clip)
    assert board is not None, "only clips of a board come here"
    return board.model_dump(exclude={"clips", "world"})


def boards(settings: Settings, experiment: Experiment, cameras: list[str]) -> Order:
    """The board that the cameras' clips show. VidtrackError where it is not one and the same."""
    own = settings.calibration.board
    clips = list(dict.fromkeys(clip for camera in cameras for clip in board_clips(settings, experiment, camera)))
    described = [board for clip in clips if (board := board_of(settings, experiment, clip))]
    shown = [_board(settings, experiment, clip) for clip in clips]
    if different := [clip for clip, board in zip(clips, shown, strict=True) if board != shown[0]]:
        raise VidtrackError(
            f"calibration: clips {clips[0]} and {different[0]} show different boards. Use one board for all, or leave "
            "one of the clips out."
        )
    world = next((board.world for board in [*described, *([own] if own else [])] if board.world), None)
    return {"units": settings.units, "cameras": cameras, "board": shown[0], "world": world}


def tied(settings: Settings, experiment: Experiment, cameras: list[str]) -> list[str]:
    """Those of the cameras whose places to each other a board may show, where surveyed points place some of them.

    Closed-form calibration has no place for what is known beforehand.
    """
    if settings.calibration.refine not in ("full", "bundle"):
        return []
    found = [c for c in cameras if board_clips(settings, experiment, c) and lens_of(settings, c) is None]
    surveyed = [c for c in found if clips_of(settings, experiment, c)]
    return found if surveyed and len(found) > 1 else []


def bundle(settings: Settings, boarded: list[str], tied: list[str], bare: list[str]) -> Order:
    """What the bundle has beside its own order, where a board ties cameras: see `jobs.bundle`."""
    own = {"boarded": boarded, "bare": [c for c in bare if c in tied]}
    return own | {"board_only": settings.calibration.refine != "bundle"}
