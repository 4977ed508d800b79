"""A scenario: a laboratory as it is planned or imagined, written as YAML. data/demo.yaml is one, with comments.

    cameras      where they stand, how they see, how their clocks err
    picture      light, noise, grey levels (each camera may differ)
    recording    rate, fields, shutter, tape
    calibration  balls that are surveyed (with error) and filmed, clip by clip
    runs         what moves, when, and what a contact sensor would record of it
Every length is in `units`, every time in seconds, every place on the sensor in mm, every place in a picture in px.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from vidtrack.geometry.camera import Camera
from vidtrack.geometry.projection import Projection
from vidtrack.simulate.background import Texture
from vidtrack.simulate.control_points import ControlPoints, tags_and_places
from vidtrack.simulate.lamp import Lamp
from vidtrack.simulate.motion import Motion, Oscillation
from vidtrack.simulate.picture import Patch, Picture
from vidtrack.simulate.plan import NotNegative, Plan, Positive, Rate, Tags, Vector, plan_from
from vidtrack.simulate.recording import Clock, Interlace, Shutter
from vidtrack.simulate.rig import focal_length_from_field, look_at, position_from_angles
from vidtrack.simulate.tape import Tape
from vidtrack.simulate.through import InterfacePlan, interfaces_of
from vidtrack.timing.timecode import Timecode, parse

Count = Annotated[int, Field(ge=1)]
Side = Annotated[int, Field(ge=1, le=16_384)]


class CameraPlan(Plan):
    """A camera: a place (position, or pan, tilt and distance), what it looks at, its lens, sensor and clock."""

    target: Vector = Field((0.0, 0.0, 0.0), description="world, a point on the optical axis")
    position: Vector | None = Field(None, description="world; or give pan_deg, tilt_deg and distance from the target")
    pan_deg: float | None = Field(None, description="from +x toward +y, of the direction in which the camera looks")
    tilt_deg: float | None = Field(None, description="downward")
    distance: Positive | None = None
    roll_deg: float = Field(0.0, description="clockwise as seen from behind the camera")
    size: tuple[Side, Side] = Field((512, 480), description="px, width and height of the frame buffer")
    sensor: tuple[Positive, Positive] = Field((8.8, 6.6), description="mm, width and height that the frame covers")
    f: Positive | None = Field(None, description="mm; or give field")
    field: Positive | None = Field(None, description="world units, width of the picture at the target")
    Sx: Positive = 1.0
    centre: tuple[float, float] | None = Field(None, description="px, Cx and Cy; default: the middle")
    kappa1: float = Field(0.0, description="1/mm^2, as Tsai's: Xu = Xd (1 + kappa1 r^2); positive is barrel")
    kappa2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    skew: float = 0.0
    projection: Projection = Field(
        "perspective", description="or equidistant, of lenses beyond 100 degrees: f times the angle, not its tangent"
    )
    through: tuple[str, ...] = Field((), description="interfaces through which it sees, from the camera on")
    clock: Clock = Clock()
    picture: dict[str, Any] = Field({}, description="whatever differs from the scenario's picture")

    @model_validator(mode="after")
    def _stands_and_sees(self) -> Self:
        angles = (self.pan_deg, self.tilt_deg, self.distance)
        if (self.position is None) == all(a is None for a in angles):
            raise ValueError("give either position or pan_deg, tilt_deg and distance")
        if self.position is None and any(a is None for a in angles):
            raise ValueError("pan_deg, tilt_deg and distance belong together; one is missing")
        if (self.f is None) == (self.field is None):
            raise ValueError("give either f (mm) or field (width of the picture at the target)")
        return self


def camera_from_plan(plan: CameraPlan, name: str = "") -> Camera:
    """The camera that a plan describes. Raises ValueError for one that stands where it looks."""
    if plan.position is not None:
        position = np.asarray(plan.position, float)
    else:
        assert plan.pan_deg is not None
        assert plan.tilt_deg is not None
        assert plan.distance is not None
        position = position_from_angles(
            plan.target, pan_deg=plan.pan_deg, tilt_deg=plan.tilt_deg, distance=plan.distance
        )
    straight_down = np.hypot(*(position[:2] - plan.target[:2])) < 1e-9
    R = look_at(position, plan.target, roll_deg=plan.roll_deg, up=(0, 1, 0) if straight_down else (0, 0, 1))
    width, height = plan.size
    distance = float(np.linalg.norm(position - plan.target))
    f = plan.f or focal_length_from_field(width=plan.field or 1.0, distance=distance, sensor_width=plan.sensor[0])
    Cx, Cy = plan.centre or ((width - 1) / 2, (height - 1) / 2)
    return Camera(
        *(
            Cx,
            Cy,
            plan.sensor[0] / width,
            plan.sensor[1] / height,
            plan.Sx,
            f,
            plan.kappa1,
            R,
            -R @ position,
            plan.size,
        ),
        kappa2=plan.kappa2,
        p1=plan.p1,
        p2=plan.p2,
        skew=plan.skew,
        projection=plan.projection,
        name=name,
    )


class Recording(Plan):
    """How frames are taken and kept."""

    rate: Rate = Field("30000/1001", validate_default=True)
    interlace: Interlace = Field("none", description="top, bottom: which field of a frame comes first, if it has two")
    shutter: Shutter = Shutter()
    drop_frame: bool = Field(False, description="whether the time code counts in drop-frame")
    tape: Tape = Tape()


class Survey(Plan):
    """How well the balls' places are known."""

    error: NotNegative = Field(0.0, description="world units on each axis of each ball")
    distribution: Literal["normal", "uniform"] = Field(
        "normal",
        description="error is the standard deviation, or the tolerance: no error exceeds it, all are as likely",
    )


class Clip(Plan):
    """One calibration clip."""

    tags: Tags = Field(None, description="the balls in view, 1-16 or a list; default: all")
    frames: Count | None = None
    picks: Tags = Field((), description="the balls that were picked on the screen, written to picks.csv")
    moved: dict[str, tuple[Vector, Vector]] = Field(
        {}, description="camera: [shift in world units, turn in degrees about its x, y, z axes] since the runs"
    )


class Calibration(Plan):
    """What the cameras are calibrated with."""

    points: ControlPoints = Field({}, description="wires, or tag: [x, y, z]")
    diameter: Positive = 2.0
    frames: Count = 20
    survey: Survey = Survey()
    picking: NotNegative = Field(2.0, description="px, sigma of a pick by hand")
    start: str = Field("09:00:00:00", description="time code of the first clip; the others follow, a minute apart")
    clips: dict[str, Clip] = Field({})
    lamp: Lamp | None = Field(None, description="by which its clips are filmed; default: the scenario's")
    marks: dict[str, Vector] = Field(
        {}, description="tag: [x, y, z] of points that are picked in the first clip of `waved`, and not surveyed"
    )


class Target(Plan):
    """A ball that moves."""

    motion: Motion = Motion()
    diameter: Positive = 2.0
    level: float | None = Field(None, description="grey level; default: the picture's background and contrast")


class Hidden(Plan):
    """A while in which a camera does not see a target."""

    camera: str
    target: str
    from_s: float
    to_s: float


class Reference(Plan):
    """A contact sensor: a string potentiometer, a wave gauge."""

    target: str
    along: Vector = Field((1.0, 0.0, 0.0), description="direction in which it measures, from the world's origin")
    column: str = "x"
    rate: Positive = 30.0
    error: NotNegative = Field(0.0625, description="world units, sigma of each reading")
    lead_s: float = Field(0.0, description="s by which its record shows the motion earlier than the video's")
    gain: float = 1.0
    bias: float = 0.0
    margin_s: NotNegative = Field(0.5, description="s recorded before and after the video")


class Instruments(Plan):
    """A recorder of other instruments, such as wave gauges, by the video's clock: channels.csv."""

    rate: Positive = Field(100.0, description="Hz")
    error: NotNegative = Field(0.0, description="in each column's unit, sigma of each reading")
    columns: dict[str, tuple[Oscillation, ...]] = Field(
        description="column: what it shows, a sum of oscillations; their directions say nothing here"
    )


Turned = tuple[float, float, float, float, float]


class Run(Plan):
    """One test: what moves, for how long, what is filmed of it."""

    start: str = Field("10:00:00:00", description="time code of its first frame")
    duration_s: Positive = 10.0
    targets: dict[str, Target] = Field({})
    others: dict[str, Target] = Field({}, description="balls in view that are no targets")
    hidden: tuple[Hidden, ...] = ()
    first_frame: dict[str, int] = Field({}, description="camera: frames after the start at which its recording begins")
    lost_frames: dict[str, tuple[int, ...]] = Field({}, description="camera: frames that its recording lacks")
    reference: Reference | None = None
    channels: Instruments | None = None
    boxes: bool = Field(False, description="whether there is a targets.csv with a start box of each target")
    turned: dict[str, tuple[Turned, ...]] = Field(
        {},
        description="camera: rows of s, degrees about its x, y and z axes, and the share by which f is longer: it "
        "moves in its place along straight lines between them, at rest before the first and after the last",
    )
    lamp: Lamp | None = Field(None, description="by which it is filmed; default: the scenario's")
    recording: Recording | None = None
    cameras: tuple[str, ...] | None = Field(None, description="those that film this run; default: all")


class Waved(Run):
    """A clip of calibration/ in which balls move: a waved wand, a ball that is dropped."""

    lengths: dict[str, Positive] = Field({}, description="what the config says of a wand: distances of its balls")
    axes: Any = Field(None, description="what the config says of the world's axes")


class Scenario(Plan):
    """A whole laboratory."""

    seed: Annotated[int, Field(ge=0)] = 1
    units: Literal["m", "cm", "mm", "in", "ft"] = "in"
    cameras: Annotated[dict[str, CameraPlan], Field(min_length=1)]
    interfaces: dict[str, InterfacePlan] = Field({}, description="windows, tank walls, water surfaces")
    picture: Picture = Picture()
    texture: Texture | None = Field(None, description="a pattern on the wall behind the scene; default: a plain one")
    lamp: Lamp | None = Field(None, description="lights all balls from one side; default: they are lit alike all over")
    clutter: tuple[Patch, ...] = ()
    recording: Recording = Recording()
    calibration: Calibration = Calibration()
    runs: dict[str, Run] = Field({})
    waved: dict[str, Waved] = Field({}, description="clip: a wand that is waved, filmed into calibration/")

    @model_validator(mode="after")
    def _names_agree(self) -> Self:
        known = set(self.cameras)
        for where, names in self._cameras_named():
            if not set(names) <= known:
                raise ValueError(f"{where}: no camera {sorted(set(names) - known)[0]!r} in this scenario")
        for name, run in self.runs.items():
            named = {hidden.target for hidden in run.hidden} | ({run.reference.target} if run.reference else set())
            if not named <= {*run.targets, *run.others}:
                raise ValueError(
                    f"runs.{name}: no target {sorted(named - {*run.targets, *run.others})[0]!r} in this run"
                )
            self.start_of(name)
        tags = set(self.points()[0])
        for name, clip in self.calibration.clips.items():
            unknown = {*(clip.tags or ()), *(clip.picks or ())} - tags
            if unknown:
                raise ValueError(f"calibration.clips.{name}: no ball has tag {sorted(unknown)[0]!r}")
        for name, camera in self.cameras.items():
            self.picture_of(name)
            if not set(camera.through) <= set(self.interfaces):
                raise ValueError(f"cameras.{name}.through: no such interface in this scenario")
            self.camera(name)
        return self

    def _cameras_named(self) -> list[tuple[str, list[str]]]:
        named = [("clutter", [patch.camera for patch in self.clutter])]
        named += [(f"calibration.clips.{n}.moved", list(clip.moved)) for n, clip in self.calibration.clips.items()]
        for n, run in self.runs.items():
            named.append((f"runs.{n}.hidden", [hidden.camera for hidden in run.hidden]))
            named.append((f"runs.{n}", [*run.first_frame, *run.lost_frames, *run.turned, *(run.cameras or ())]))
        return named

    def camera(self, name: str) -> Camera:
        """The camera of that name."""
        plan = self.cameras[name]
        return camera_from_plan(plan, name).with_(through=interfaces_of(self.interfaces, plan.through))

    def picture_of(self, name: str) -> Picture:
        """How that camera makes its pictures."""
        return Picture.model_validate({**self.picture.model_dump(), **self.cameras[name].picture})

    def recording_of(self, run: str) -> Recording:
        """How a run is recorded: its own way, or the scenario's."""
        return self.runs[run].recording or self.recording

    def start_of(self, run: str) -> Timecode:
        """The time code of a run's frame 0."""
        recording = self.recording_of(run)
        return parse(self.runs[run].start, recording.rate, recording.drop_frame)

    def first_frame_of(self, run: str) -> int:
        """The frame of the scene with which the earliest of a run's recordings begins."""
        plan = self.runs[run]
        return min([plan.first_frame.get(name, 0) for name in plan.cameras or self.cameras])

    def first_code_of(self, run: str) -> Timecode:
        """The time code of that frame, which sets the run's scale of time."""
        return self.start_of(run) + self.first_frame_of(run)

    def points(self) -> tuple[list[str], np.ndarray[Any, np.dtype[np.float64]]]:
        """Tags and true places (n, 3) of the calibration balls."""
        return tags_and_places(self.calibration.points)


def scenario_from(values: Mapping[str, Any], where: str = "scenario") -> Scenario:
    """The scenario that parsed YAML means; VidtrackError with every problem at once."""
    return plan_from(Scenario, values, where)


def n_frames(run: Run, recording: Recording) -> int:
    """How many frames each camera records of a run."""
    return round(run.duration_s * recording.rate)


def random_stream(scenario: Scenario, *names: str) -> np.random.Generator:
    """Random numbers of one file alone, distinguished by its name."""
    seed = np.random.SeedSequence([scenario.seed, zlib.crc32("/".join(names).encode())])
    return np.random.Generator(np.random.SFC64(seed))
