"""camparm.dat: what is fixed of both cameras, typed by hand and read by calb, back and locate.

    two lines of any text
    Ncx Ncy Nfx Cx Cy sensor-width sensor-height      of camera 1; what follows on the line is not read
    Ncx Ncy Nfx Cx Cy sensor-width sensor-height      of camera 2
    field1 field2                                     diagonal fields of view, in the unit of the survey

Ncx, Ncy sensor elements in X and Y; Nfx columns of the frame buffer; Cx, Cy px; the sensor in mm. dx = width / Nfx and
dy = height / Ncy. Both rows have an Nfx and the programs keep the second one for both. calb reads the row of camera
1 and uses it for both cameras (in its place of the field it reads camera 2's Ncx, Ncy): camera 2 was calibrated with
camera 1's Cx, Cy and sensor, but located with its own. Text lines may stand between the rows.
"""

from __future__ import annotations

from typing import NamedTuple

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, leading_numbers, lines_of
from vidtrack.files.atomic import replacing


class Fixed(NamedTuple):
    """What is fixed of one camera: sensor elements, px, mm."""

    Ncx: float
    Ncy: float
    Nfx: float
    Cx: float
    Cy: float
    width: float
    height: float

    @property
    def dx(self) -> float:
        """mm a column of the frame buffer."""
        return self.width / self.Nfx

    @property
    def dy(self) -> float:
        """mm a row."""
        return self.height / self.Ncy

    @property
    def image_size(self) -> tuple[int, int]:
        """px, the frame buffer."""
        return round(self.Nfx), round(self.Ncy)


class Camparm(NamedTuple):
    """A whole file. field: the diagonal field of view of each camera, world units; text: its first two lines."""

    cameras: tuple[Fixed, ...]
    field: tuple[float, ...]
    text: tuple[str, str] = ("", "")


def read_camparm(path: Path) -> Camparm:
    """Read camparm.dat, of one camera or two."""
    lines = lines_of(path)
    if len(lines) < 3:
        raise VidtrackError(f"{path}: {len(lines)} lines; two of text and one a camera are needed. Copy it again.")
    rows = [(i + 1, found) for i, line in enumerate(lines) if i >= 2 and (found := leading_numbers(line))]
    cameras: list[Fixed] = []
    for line, found in rows[:2]:
        if len(found) < 7 and cameras:
            break
        if len(found) < 7:
            raise VidtrackError(
                f"{path}, line {line}: {len(found)} numbers; a camera has Ncx Ncy Nfx Cx Cy width height. Correct "
                "the line."
            )
        fixed = Fixed(*found[:7])
        if min(fixed.Ncx, fixed.Ncy, fixed.Nfx, fixed.width, fixed.height) <= 0:
            raise VidtrackError(f"{path}, line {line}: a count of pixels or a size is not positive. Correct the line.")
        cameras.append(fixed)
    if not cameras:
        raise VidtrackError(f"{path}: no line of a camera's numbers after the first two lines. Copy the file again.")
    last = rows[len(cameras)][1] if len(rows) > len(cameras) else []
    return Camparm(tuple(cameras), tuple(last[:2]), (lines[0], lines[1]))


def write_camparm(path: Path, camparm: Camparm) -> None:
    """Write camparm.dat; numbers keep all their digits."""
    text = camparm.text if any(camparm.text) else ("camera fixed parameters", "Ncx Ncy Nfx Cx Cy sensorx sensory")
    rows = ["  ".join(f"{value:.17g}" for value in fixed) for fixed in camparm.cameras]
    rows.append("  ".join(f"{value:.17g}" for value in camparm.field))
    with replacing(path) as file:
        file.write("\n".join([*text, *rows, ""]).encode())
