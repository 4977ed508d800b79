"""The part of the calibration's picture that a run's picture shows, and the camera as that picture has it.

A camera records at several both. Where the whole picture is scaled, or a rectangle of it is cut out and scaled, a
column or row of the one follows from that of the other by the corners of the rectangle, pixels being unit squares about
their centres:

    Xf' + 1/2 = (Xf + 1/2 - left) columns / width,      Yf' + 1/2 = (Yf + 1/2 - top) rows / height

The same shape is taken for the whole picture, scaled, and said. Any other shape may be cut off, squeezed or both, and
nothing in the file says which: that needs `crop`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera

ROUNDING_PX = 1.0
"""Encoders round a scaled picture to whole, often even, columns and rows."""

SAME_BARS_PX, SAME_BARS = 3.0, 0.01
"""Px, and share of the picture, by which bars of one camera's films differ that are the same: softened by scaling."""


class Picture(NamedTuple):
    """A recording's picture, as a player turns it.

    width, height  px
    sample_aspect  width of a pixel over its height; 1 where nothing is said
    rotation       degrees, by which the file says that it was turned
    bars           px at the left, top, right and bottom that show nothing: the film is set into a larger picture
    """

    width: int
    height: int
    sample_aspect: Fraction = Fraction(1)
    rotation: int = 0
    bars: tuple[int, int, int, int] = (0, 0, 0, 0)

    @property
    def size(self) -> str:
        return f"{self.width} x {self.height}"

    @property
    def within(self) -> Picture:
        """What the bars leave of it."""
        left, top, right, bottom = self.bars
        size = self.width - left - right, self.height - top - bottom
        return self._replace(width=size[0], height=size[1], bars=(0, 0, 0, 0))


class Window(NamedTuple):
    """The rectangle of the calibration's picture that another shows in columns x rows px; px from corner to corner."""

    left: float
    top: float
    width: float
    height: float
    columns: int
    rows: int

    @property
    def scale(self) -> Array:
        """Px of the picture per px of the calibration's, (2,)."""
        return np.array([self.columns / self.width, self.rows / self.height])

    def seen(self, b: ArrayLike) -> Array:
        """Frame buffer positions (..., 2) of the calibration's picture, as the window's picture has them."""
        seen: Array = (np.asarray(b, float) + 0.5 - np.array([self.left, self.top])) * self.scale - 0.5
        return seen

    def back(self, b: ArrayLike) -> Array:
        """Positions (..., 2) of the window's picture, in that of the calibration: the inverse of `seen`."""
        back: Array = (np.asarray(b, float) + 0.5) / self.scale - 0.5 + np.array([self.left, self.top])
        return back

    def camera(self, camera: Camera) -> Camera:
        """The camera as the window's picture has it: the same lens and place, another frame buffer."""
        sx, sy = self.scale.tolist()
        Cx, Cy = self.seen([camera.Cx, camera.Cy]).tolist()
        size = (self.columns, self.rows)
        return camera.with_(dx=camera.dx / sx, dy=camera.dy / sy, Cx=Cx, Cy=Cy, image_size=size)

    def covariance(self, names: Sequence[str], covariance: ArrayLike) -> Array:
        """The covariance (k, k) of a camera's parameters: those in px are scaled, the others stay."""
        sx, sy = self.scale.tolist()
        by = np.array([{"Cx": sx, "Cy": sy}.get(name, 1.0) for name in names])
        scaled: Array = np.asarray(covariance, float) * by * by[:, None]
        return scaled


def picture_from_record(record: Mapping[str, Any]) -> Picture:
    """The picture as a record has it: width, height; sample_aspect and rotation where they are known."""
    aspect = Fraction(str(record.get("sample_aspect", "1")))
    left, top, right, bottom = (int(px) for px in record.get("bars", (0, 0, 0, 0)))
    size, turn = (int(record["width"]), int(record["height"])), int(record.get("rotation", 0))
    return Picture(*size, aspect or Fraction(1), turn, (left, top, right, bottom))


def window(
    calibrated: Picture, run: Picture, crop: Sequence[float] | None = None, *, camera: str, where: str
) -> tuple[Window | None, list[Finding]]:
    """What a run's picture shows of the calibration's; None where they are the same picture.

    crop   left, top, width, height, px of the calibration's picture, that the run shows; None: not given
    Raises VidtrackError where the shapes differ, of the pictures or of their pixels, and no crop is given.
    """
    found = [*_turned(calibrated, run, camera, where), *_other_pixels(calibrated, run, crop, camera, where)]
    if crop is not None:
        left, top, width, height = (float(number) for number in crop)
        given = Window(left, top, width, height, run.width, run.height)
        if np.allclose(given, (0, 0, calibrated.width, calibrated.height, calibrated.width, calibrated.height)):
            return None, found
        return given, [*found, *_squeezed(given, calibrated, run, camera, where)]
    if _framed(calibrated, run):
        part, other = _without_bars(calibrated, run, camera, where)
        return part, [*found, other]
    if (calibrated.width, calibrated.height) == (run.width, run.height):
        return None, found
    if not _alike(calibrated, run):
        raise VidtrackError(_refusal(calibrated, run, camera, where))
    whole = Window(0.0, 0.0, calibrated.width, calibrated.height, run.width, run.height)
    text = (
        f"{where}: {camera} shows {run.size} px and was calibrated at {calibrated.size}. It is taken for the same "
        "picture, scaled; if it is a part of it instead, all positions are wrong."
    )
    cure = (
        f"Confirm it by `crop: [0, 0, {calibrated.width}, {calibrated.height}]` for the run, give the part that it "
        "shows, or calibrate with clips of the run's size."
    )
    return whole, [*found, Finding("doubtful", "picture-scaled", text, cure)]


def _framed(calibrated: Picture, run: Picture) -> bool:
    """Whether only one of two pictures has bars, or both have others."""
    size = np.array([run.width, run.height] * 2)
    scaled = np.array(calibrated.bars) * size / np.array([calibrated.width, calibrated.height] * 2)
    return bool((np.abs(scaled - run.bars) > np.maximum(SAME_BARS_PX, SAME_BARS * size)).any())


def _without_bars(calibrated: Picture, run: Picture, camera: str, where: str) -> tuple[Window | None, Finding]:
    """What a run shows within its bars, taken for what its calibration shows within its own.

    Raises VidtrackError where these have two shapes, and the pictures are of two sizes.
    """
    one, other = calibrated.within, run.within
    text = f"{where}: {camera} shows {_bars(run)}, and its calibration {_bars(calibrated)}"
    cure = "Use the camera's own files, not a recording of a player's window or an export into a larger picture"
    if not _alike(one, other):
        if (calibrated.width, calibrated.height) != (run.width, run.height):
            raise VidtrackError(
                f"{text}; without bars {other.size} px are left of the one and {one.size} px of the other, another "
                f"shape. {cure}; or give `crop: [left, top, width, height]` for the run: the part of the "
                "calibration's picture that it shows, bars and all (left and top may be below 0)."
            )
        text += ". They are taken for a cover: if the film was scaled or shifted to stand between them, all positions"
        return None, Finding("doubtful", "picture-framed", f"{text} are wrong.", f"{cure}.")
    sx, sy = other.width / one.width, other.height / one.height
    left, top = calibrated.bars[0] - run.bars[0] / sx, calibrated.bars[1] - run.bars[1] / sy
    part = Window(left, top, run.width / sx, run.height / sy, run.width, run.height)
    text += (
        f". What they leave, {other.size} px, is taken for the {one.size} px of its calibration, scaled: good to a "
        "pixel, and wrong if it is only a part of them."
    )
    crop = ", ".join(f"{value:g}" for value in np.round(part[:4], 1))
    return part, Finding("doubtful", "picture-framed", text, f"{cure}; or confirm it by `crop: [{crop}]` for the run.")


def _bars(picture: Picture) -> str:
    """Its bars in words."""
    wide = dict(zip(("left", "top", "right", "bottom"), picture.bars, strict=True))
    named = [f"{px} px at the {side}" for side, px in wide.items() if px]
    return f"bars about its picture ({', '.join(named)})" if named else "none"


def _alike(a: Picture, b: Picture) -> bool:
    """Whether two pictures have one shape, as stored or as shown, but for rounding to whole px."""
    for aspect in {Fraction(1), b.sample_aspect / a.sample_aspect}:
        wanted = a.height * b.width * float(aspect) / a.width  # rows of a, scaled to the columns of b
        if abs(wanted - b.height) <= ROUNDING_PX * max(1.0, b.height / b.width):
            return True
    return False


def _turned(a: Picture, b: Picture, camera: str, where: str) -> list[Finding]:
    if a.rotation == b.rotation or (a.width, a.height) != (b.width, b.height):
        return []
    text = (
        f"{where}: {camera}'s file says that it is turned by {b.rotation} degrees, those of its calibration by "
        f"{a.rotation}. Either the camera was turned after its calibration, or one of the files is wrong."
    )
    cure = "Look at both in a player: where only one is upside down, remove the rotation flag from that file."
    return [Finding("bad", "rotation-differs", text, cure)]


def _other_pixels(a: Picture, b: Picture, crop: Sequence[float] | None, camera: str, where: str) -> list[Finding]:
    """Pictures of one size whose pixels have two shapes: a camera's wide mode shows another part of the scene."""
    one, other = a.sample_aspect, b.sample_aspect
    if crop is not None or one == other or (a.width, a.height) != (b.width, b.height):
        return []
    if 1 not in (one, other):
        raise VidtrackError(
            f"{where}: {camera} shows pixels of shape {other.numerator}:{other.denominator} and was calibrated with "
            f"{one.numerator}:{one.denominator}, as a camera's wide and normal modes have them. Calibrate in the "
            "mode of the run, or give `crop: [left, top, width, height]` for the run: the part of the calibration's "
            f"picture that it shows, [0, 0, {a.width}, {a.height}] if it is the same."
        )
    text = (
        f"{where}: {camera}'s file states pixels of shape {other.numerator}:{other.denominator}, the file of its "
        f"calibration {one.numerator}:{one.denominator}. 1:1 may mean that a file states no shape: both pictures are "
        "treated as the same part of the scene, pixel by pixel"
    )
    cure = (
        f"If they are the same part, give `crop: [0, 0, {a.width}, {a.height}]` for the run; if not, give the part of "
        "the calibration's picture that the run shows."
    )
    return [Finding("doubtful", "pixel-shape-differs", text, cure)]


def _squeezed(given: Window, calibrated: Picture, run: Picture, camera: str, where: str) -> list[Finding]:
    """A crop of another shape than the picture is used as it is given, but is seldom meant."""
    part = Picture(max(round(given.width), 1), max(round(given.height), 1), calibrated.sample_aspect)
    if _alike(part, run):
        return []
    sx, sy = given.scale.tolist()
    text = (
        f"{where}: {camera}'s crop is {given.width:g} x {given.height:g} px and its picture {run.size}: X is scaled "
        f"by {sx:.4g} and Y by {sy:.4g}."
    )
    return [Finding("doubtful", "crop-of-another-shape", text, "Correct crop, unless the picture is truly squeezed.")]


def _refusal(calibrated: Picture, run: Picture, camera: str, where: str) -> str:
    both = f"{where}: {camera} shows {run.size} px and was calibrated at {calibrated.size}"
    if _alike(calibrated, Picture(run.height, run.width, 1 / run.sample_aspect)):
        return (
            f"{both}: one of them is turned by a quarter (rotation flags: {run.rotation} and {calibrated.rotation} "
            "degrees). Give both recordings the same rotation flag, or calibrate the camera as it stood in the run."
        )
    if run.width == calibrated.width and run.height * 2 == calibrated.height:
        return f"{both}: single fields or squeezed. Record whole frames, or give `crop` for the run if it is squeezed."
    share = min(calibrated.width / run.width, calibrated.height / run.height)
    width, height = run.width * share, run.height * share
    left, top = (calibrated.width - width) / 2, (calibrated.height - height) / 2
    return (
        f"{both}: another shape, cut off or squeezed. Give `crop: [left, top, width, height]` (px of the calibration's "
        f"picture that it shows) for the run or the camera, such as [{left:g}, {top:g}, {width:g}, {height:g}] where "
        "the edges are cut off evenly; or calibrate with clips of the run's size."
    )
