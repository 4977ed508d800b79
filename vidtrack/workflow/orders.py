"""Exactly the settings that each rule uses: a change of any other setting reruns nothing.

Each function answers the plain values that one job gets; the workflow gives them to it as Snakemake `params`.
"""

from __future__ import annotations

from typing import Any

from vidtrack.files.experiment import (
    Experiment,
    Run,
    board_of,
    point_tags,
    reference_columns,
    tags_of,
    target_names,
    within,
)
from vidtrack.settings.config import Settings, detect_for
from vidtrack.settings.lens import Lens
from vidtrack.timing.clock_methods import methods_of
from vidtrack.workflow.own_settings import (
    clock_of,
    crop_of,
    detect_of_clip,
    own_of,
    recording_of,
    targets_of,
    without_colour,
)
from vidtrack.workflow.tag_orders import tagged, tags_read, untagged
from vidtrack.workflow.waved import wand_cameras, wand_clips

Order = dict[str, Any]
STILL_KEYS = ("polarity", "threshold", "centroid", "min_pixels", "start", "end", "gain", "offset")
"""The detect settings by which balls that stand still are found in a calibration clip."""


def track(settings: Settings, experiment: Experiment, run: str, camera: str) -> Order:
    """How a run's targets are followed in one camera."""
    own = own_of(settings, run)
    return {
        "run": run,
        "camera": camera,
        "detect": without_colour(detect_for(settings, own, own.detect)),
        "targets": targets_of(settings, experiment.runs[run]),
        "start_timecode": own.start_timecode,
        "recording": recording_of(settings, experiment.runs[run], camera),
    } | ({"tags": tags} if (tags := tags_read(own)) else {})


def calibration_points(settings: Settings, experiment: Experiment, camera: str, after: bool = False) -> Order:
    """Which tags each of a camera's clips shows, and how they are distinguished from the background."""
    tags = point_tags(experiment)
    return {
        "units": settings.units,
        "camera": camera,
        "after": after,
        "sigma": settings.calibration.sigma,
        "picks_clips": [clip for clip in clips_of(settings, experiment, camera, after) if experiment.clips[clip].picks],
        "clips": {
            clip: {
                "tags": tags_of(settings, clip, tags),
                "detect": {key: detect_of_clip(settings, clip)[key] for key in STILL_KEYS},
                "recording": recording_of(settings, experiment.clips[clip], camera),
            }
            for clip in clips_of(settings, experiment, camera, after)
        },
    }


def clips_of(settings: Settings, experiment: Experiment, camera: str, after: bool = False) -> list[str]:
    """A camera's clips from before the test, or those from after it, in the order of their names."""
    late, waved = settings.calibration.after, wand_clips(settings)
    here = [n for n, c in experiment.clips.items() if camera in c.videos and n not in waved and (n in late) == after]
    return [name for name in here if board_of(settings, experiment, name) is None]


def calibrated(settings: Settings, experiment: Experiment) -> list[str]:
    """Cameras to calibrate: those in clips, but for those that only runs in a plane use, or none where all are such."""
    modes: dict[str, set[str]] = {}
    for name, run in experiment.runs.items():
        for camera in run.videos:
            modes.setdefault(camera, set()).add(own_of(settings, name).mode)
    waved = wand_cameras(settings, experiment)
    only_planes = bool(modes) and set.union(*modes.values()) == {"plane"}
    return [
        camera
        for camera in experiment.cameras_in_clips()
        if not only_planes
        and modes.get(camera) != {"plane"}
        and camera not in waved
        and (clips_of(settings, experiment, camera) or _boarded(settings, experiment, camera))
    ]


def _boarded(settings: Settings, experiment: Experiment, camera: str) -> bool:
    """Whether a clip shows a board to the camera."""
    here = [name for name, clip in experiment.clips.items() if camera in clip.videos]
    return any(board_of(settings, experiment, name) for name in here)


def survey(settings: Settings, cameras: list[str]) -> Order:
    """How all cameras together judge the surveyed points."""
    how = settings.calibration
    through = {camera: own for camera in cameras if (own := _through(settings, camera))}
    order: Order = {"units": settings.units, "cameras": cameras, "sigma": how.sigma, "reject": how.reject}
    return order | ({"through": through} if through else {})


def calibrate(settings: Settings, camera: str, board: bool = False) -> Order:
    """How one camera is calibrated; board: its lens is that of a board, where the config names no other."""
    by_board = {"lens": {"use": "prior", "board": True}} if board else {}
    own, how = settings.cameras[camera], settings.calibration
    return {
        "units": settings.units,
        "camera": camera,
        "Cx": own.Cx,
        "Cy": own.Cy,
        "sensor": own.sensor,
        "model": own.calibration.model or how.model,
        "refine": how.refine,
        "fix": fix_of(settings, camera),
        "prior": prior_of(settings, camera),
        "reject": how.reject,
        "sigma": how.sigma,
        **({"lens": lens.model_dump()} if (lens := lens_of(settings, camera)) else by_board),
        **({"flat": True} if how.flat else {}),
    } | ({"through": through} if (through := _through(settings, camera)) else {})


def _through(settings: Settings, camera: str) -> list[Order]:
    """The interfaces through which a camera sees, from it on."""
    named = settings.cameras[camera].through
    return [{"name": name, **settings.interfaces[name].model_dump(exclude_none=True)} for name in named]


def lens_of(settings: Settings, camera: str) -> Lens | None:
    """What the config says of a camera's lens: its own section, else that of all cameras."""
    return settings.cameras[camera].calibration.lens or settings.calibration.lens


def lens_file(settings: Settings, camera: str) -> str | None:
    """The file of a camera's known lens; None where none is named."""
    lens = lens_of(settings, camera)
    return within(settings.experiment, lens.file) if lens and lens.file else None


def fix_of(settings: Settings, camera: str) -> Order:
    both = (settings.calibration.fix, settings.cameras[camera].calibration.fix)
    return {str(name): value for fix in both for name, value in fix.items()}


def prior_of(settings: Settings, camera: str) -> Order:
    here = settings.cameras[camera].calibration
    return {name: p for name, p in {**settings.calibration.prior, **here.prior}.items() if name not in here.fix}


def bundle(settings: Settings, cameras: list[str]) -> Order:
    """How all cameras are refined together."""
    how = settings.calibration
    prior = {camera: prior_of(settings, camera) for camera in cameras}
    return {"units": settings.units, "cameras": cameras, "prior": prior, "sigma": how.sigma}


def back_project(settings: Settings, cameras: list[str]) -> Order:
    """How the calibration is checked on its own points."""
    how = settings.calibration
    return {
        "units": settings.units,
        "cameras": cameras,
        "refine": how.refine,
        "prior": {camera: prior_of(settings, camera) for camera in cameras},
        "sigma": how.sigma,
    }


def clocks(settings: Settings, experiment: Experiment, run: str) -> Order:
    """Which cameras' clocks are sought in the sound and the light of a run, and which cameras give the time."""
    here = experiment.runs[run]
    cameras = [c for c in here.videos if c not in here.tracks] if own_of(settings, run).mode == "space" else []
    methods = dict(zip(cameras, methods_of([settings.cameras[c].clock for c in cameras]), strict=True))
    sought = {c: [w for w in own if w != "motion"] for c, own in methods.items()}
    return {
        "run": run,
        "cameras": cameras,
        "references": [c for c in cameras if not methods[c]],
        "sought": {c: own for c, own in sought.items() if own},
        "recordings": {c: how for c in cameras if (how := recording_of(settings, experiment.runs[run], c))},
    }


def steadiness(settings: Settings, experiment: Experiment, run: str) -> Order:
    """Of which cameras of a run it is seen whether they stood still: those that were filmed and calibrated by clips."""
    own, here = own_of(settings, run), experiment.runs[run]
    seen = [c for c in here.videos if c not in here.tracks and c not in experiment.given]
    seen = [c for c in seen if not any(c in clip.digitised for clip in experiment.clips.values())]
    return {
        "units": settings.units,
        "run": run,
        "mode": own.mode,
        "cameras": seen,
        "crop": {c: crop for c in seen if (crop := crop_of(settings, run, c))},
        "clip": own.plane.clip if own.plane else None,
        "scale": own.plane.scale if own.plane else None,
        "follow": settings.calibration.follow,
    }


def locate(settings: Settings, experiment: Experiment, run: str) -> Order:
    """How a run's tracks become positions."""
    own, here = own_of(settings, run), experiment.runs[run]
    plane = own.plane.model_dump() if own.plane else None
    bent, pixels = [], {}
    if own.mode == "plane" and plane:
        camera = next(iter(here.videos))
        bent = _through(settings, camera) if plane["points"] else []
        pixels = {"sensor": settings.cameras[camera].sensor} if plane["aspect"] is None else {}
    return {
        "units": settings.units,
        "run": run,
        "mode": own.mode,
        "cameras": list(here.videos),
        "targets": targets_of(settings, here),
        "clocks": {c: clock_of(settings, c) for c in here.videos},
        "readout_ms": {c: ms for c in here.videos if (ms := settings.cameras[c].readout_ms) is not None},
        "crop": {c: crop for c in here.videos if (crop := crop_of(settings, run, c))},
        "tolerance_px": own.tolerance_px,
        "max_miss": own.max_miss,
        "bodies": {name: body.targets for name, body in own.bodies.items() if len(body.targets) > 2},
        "plane": plane,
        "follow": settings.calibration.follow,
        **({"through": bent} if bent else {}),
        **({"flat": True} if own.flat else {}),
        **({} if settings.calibration.same_balls else {"same_balls": False}),
        **pixels,
        **tagged(own),
    }


def kinematics(settings: Settings) -> Order:
    """How positions become velocities and accelerations."""
    return {"units": settings.units}


def bodies(settings: Settings, run: str) -> Order:
    """Which targets make a body, and where they sit in it."""
    return {"units": settings.units, "run": run, "bodies": untagged(own_of(settings, run))}


def analysis(settings: Settings, experiment: Experiment, run: str) -> Order:
    """What is estimated from a run's motions."""
    own = own_of(settings, run)
    wanted = own.analysis.model_dump() if own.analysis else {}
    return {
        "units": settings.units,
        "run": run,
        "points": {name: body.named for name, body in own.bodies.items()},
        "shapes": {name: body.targets for name, body in own.bodies.items()},
        "axes": axes.model_dump() if (axes := own.axes or settings.axes) else None,
        "about": own.about,
        "decay": wanted.get("decay"),
        "waves": wanted.get("waves"),
        "channels": own.channels.model_dump(exclude={"file"}) if own.channels else None,
        **({"cameras": list(experiment.runs[run].videos)} if lamp_of(settings, run) else {}),
    }


def lamp_of(settings: Settings, run: str) -> str | None:
    """The column of a lamp that joins the clock of other instruments to the video's, where there is one."""
    channels = own_of(settings, run).channels
    return channels.clock.lamp if channels and channels.clock else None


def compare(settings: Settings, experiment: Experiment, run: str) -> Order:
    """Which column of the contact sensor's record is compared with which target and axis."""
    here, own = experiment.runs[run], own_of(settings, run)
    order: Order = {"units": settings.units, "run": run, "mode": own.mode}
    order |= {"time": None, "value": None, "axis": None, "target": None}
    if here.reference:
        order |= own.reference.model_dump() if own.reference else _guessed_reference(here)
        named = here.tracks and own.targets is None  # by their files
        order["target"] = order["target"] or (None if named else target_names(settings, here)[0])
    if own.truth:
        order["truth"] = own.truth.model_dump()
    if here.truth:
        order["named"] = isinstance(own.targets, tuple) or bool(here.targets)
    return order


def waterline(settings: Settings, experiment: Experiment, run: str, camera: str) -> Order:
    """Along which transects of a run the water's edge is followed."""
    own = own_of(settings, run)
    assert own.waterline is not None, "the rule exists only where the config names transects"
    return {
        "units": settings.units,
        "run": run,
        "camera": camera,
        "still": own.waterline.still_water,
        "transects": {n: t.model_dump(by_alias=True) for n, t in own.waterline.transects.items()},
        "detect": without_colour(detect_for(settings, own, own.detect)),
        "start_timecode": own.start_timecode,
        "clock": clock_of(settings, camera),
        "crop": crop_of(settings, run, camera),
        "recording": recording_of(settings, experiment.runs[run], camera),
    }


def _guessed_reference(run: Run) -> Order:
    """A record that the config does not describe: time in the first column, the value in the second, x."""
    columns = reference_columns(run) or ["time_s", ""]
    return {"time": columns[0], "value": columns[1] if len(columns) > 1 else columns[0], "axis": "x", "target": None}
