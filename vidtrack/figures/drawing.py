"""A chart before it is drawn: axes in rows and columns with lines, bands and pictures in their own units.

A page of a run holds a dozen charts, and a season has hundreds of pages: matplotlib needs a quarter of a second for
each, most of it for measuring text. What is described here becomes SVG in milliseconds (`svg.py`), sharp on paper and
in the colours of the page, light or dark.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from vidtrack.arrays import Array

INK = "currentColor"
"""The colour of the page's own text: dark on paper, light on a dark screen."""

INCH = 110.0
"""px an inch of a figure's size."""

MARGIN = 0.05
"""What axes show beyond their data, as a share of them."""


class Line(NamedTuple):
    """Points (n,), joined or not; NaN interrupts. mark: one of `. o s ^ D v + x |`, size in px; dash: of SVG."""

    x: Array
    y: Array
    colour: str
    width: float = 1.2
    dash: str = ""
    mark: str = ""
    size: float = 4.0
    hollow: bool = False
    label: str = ""
    joined: bool = True


class Band(NamedTuple):
    """What lies between two curves (n,), shaded."""

    x: Array
    low: Array
    high: Array
    colour: str


class Word(NamedTuple):
    """A text at a point, moved by px to the right and down."""

    x: float
    y: float
    text: str
    colour: str = INK
    shift: tuple[float, float] = (6.0, -5.0)


class Picture(NamedTuple):
    """A picture by the address of its data, between left, right, top and bottom of the axes' units."""

    uri: str
    left: float
    right: float
    top: float
    bottom: float


@dataclass
class Axes:
    """One pair of axes.

    equal    "limits": equal scales by showing more of one axis; "box": by making the axes smaller
    xlim     least and most that are shown; None: of the data; a NaN end is of the data
    x_first  what the labels of x count from
    levels   lines right across, or upright: they count for the limits of y alone
    """

    title: str = ""
    xlabel: str = ""
    ylabel: str = ""
    equal: Literal["", "limits", "box"] = ""
    xlim: tuple[float, float] | None = None
    ylim: tuple[float, float] | None = None
    x_first: float = 0.0
    ticks: bool = True
    grid: bool = True
    y_down: bool = False
    legend: bool = False
    lines: list[Line] = field(default_factory=list)
    bands: list[Band] = field(default_factory=list)
    words: list[Word] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    levels: list[Line] = field(default_factory=list)

    def plot(self, x: Any, y: Any, colour: str, **options: Any) -> None:
        """Points as a line; options: those of `Line`."""
        x, y = np.asarray(x, float), np.asarray(y, float)
        self.lines.append(Line(x, y, colour, **options))

    def dots(self, x: Any, y: Any, colour: str, **options: Any) -> None:
        """Points that are not joined."""
        self.plot(x, y, colour, **{"mark": ".", "joined": False, **options})

    def band(self, x: Any, low: Any, high: Any, colour: str) -> None:
        """Shade what lies between two curves."""
        self.bands.append(Band(np.asarray(x, float), np.asarray(low, float), np.asarray(high, float), colour))

    def around(self, x: Any, value: Any, half_width: Any, colour: str) -> None:
        """Shade a value's interval."""
        value, half_width = np.asarray(value, float), np.asarray(half_width, float)
        self.band(x, value - half_width, value + half_width, colour)

    def bars(self, x: Any, value: Any, half_width: Any, colour: str) -> None:
        """An upright bar at each point: its interval."""
        x, value, half_width = (np.asarray(v, float) for v in (x, value, half_width))
        gap = np.full_like(x, np.nan)
        self.plot(
            np.stack([x, x, gap], 1).ravel(),
            np.stack([value - half_width, value + half_width, gap], 1).ravel(),
            colour,
        )

    def word(self, x: float, y: float, text: str, colour: str = INK) -> None:
        """Write a text beside a point."""
        self.words.append(Word(float(x), float(y), text, colour))

    def level(self, value: float, colour: str = INK, *, upright: bool = False, **options: Any) -> None:
        """A line right across at one value of y, or upright at one of x."""
        ends, at = np.array([-np.inf, np.inf]), np.full(2, float(value))
        x, y = (at, ends) if upright else (ends, at)
        self.levels.append(Line(x, y, colour, **{"width": 0.9, **options}))

    def clock(self) -> None:
        """Label the time axis of what is drawn so far: seconds since midnight are shown from a whole second on."""
        begin = min((float(np.nanmin(x)) for x in self._all_x() if np.isfinite(x).any()), default=0.0)
        first = int(np.floor(begin)) if abs(begin) >= 100 else 0
        clock = f"{first // 3600:02d}:{first // 60 % 60:02d}:{first % 60:02d}"
        self.x_first = float(first)
        self.xlabel = f"time (s after {clock})" if first else "time (s)"

    def bounds(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and most of x and of y that are shown."""
        x = _limits([*self._all_x(), *(np.array([p.left, p.right]) for p in self.pictures)], self.xlim)
        values = [*(line.y for line in self.lines), *(v for band in self.bands for v in (band.low, band.high))]
        values += [line.y for line in self.levels]
        values += [np.array([p.top, p.bottom]) for p in self.pictures]
        return x, _limits(values, self.ylim)

    def _all_x(self) -> list[Array]:
        return [line.x for line in self.lines] + [band.x for band in self.bands]


@dataclass(frozen=True)
class Drawing:
    """Axes (rows, columns), `width` px wide and `height` high in all; shared: rows have one x axis, at the foot."""

    grid: tuple[tuple[Axes, ...], ...]
    width: float
    height: float
    title: str = ""
    shared: bool = False
    ratios: Sequence[float] = ()
    widths: Sequence[float] = ()

    @property
    def axes(self) -> list[Axes]:
        """All axes, row by row."""
        return [ax for row in self.grid for ax in row]

    def texts(self) -> list[str]:
        """All that is written in it, numbers at the axes left out."""
        found = [self.title]
        for ax in self.axes:
            found += [ax.title, ax.xlabel, ax.ylabel, *(word.text for word in ax.words)]
            found += [line.label for line in (*ax.lines, *ax.levels)] if ax.legend else []
        return [text for text in found if text]


def new_drawing(
    rows: int = 1,
    columns: int = 1,
    *,
    width: float = 9.0,
    height: float = 3.0,
    title: str = "",
    shared: bool = False,
    ratios: Sequence[float] = (),
) -> Drawing:
    """A drawing of rows x columns axes, `width` inches wide and `height` inches a row."""
    grid = tuple(tuple(Axes() for _ in range(columns)) for _ in range(rows))
    return Drawing(grid, INCH * width, INCH * height * rows, title, shared, ratios)


def picture_axes(ax: Axes, picture: np.ndarray[Any, Any], most: float = 0.0, within: Sequence[float] = ()) -> None:
    """Frame buffer axes under a grey picture (h, w): px, Y downward, equal scales.

    most     the grey level that is white; 0: the highest of the picture
    within   left, right, top, bottom px that are shown; empty: the whole picture
    """
    height, width = picture.shape[:2]
    white = most or float(picture.max())
    ax.pictures.append(Picture(grey_uri(picture, 0.0, white), -0.5, width - 0.5, -0.5, height - 0.5))
    left, right, top, bottom = within or (-0.5, width - 0.5, -0.5, height - 0.5)
    ax.xlim, ax.ylim, ax.y_down, ax.equal, ax.grid = (left, right), (top, bottom), True, "box", False
    ax.xlabel, ax.ylabel = "Xf (px)", "Yf (px)"


LARGEST = 800
"""px of a picture's longer side in a page: larger ones are made smaller."""


def grey_uri(picture: np.ndarray[Any, Any], black: float, white: float) -> str:
    """A grey picture between two levels, as a PNG that lies inside the page."""
    import cv2

    scale = LARGEST / max(picture.shape[:2])
    if scale < 1:
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    grey = np.clip((picture.astype(np.float32) - black) * (255.0 / max(white - black, 1.0)), 0, 255).astype(np.uint8)
    _, png = cv2.imencode(".png", grey)
    return "data:image/png;base64," + base64.b64encode(png.tobytes()).decode()


def _limits(values: Sequence[Array], asked: tuple[float, float] | None) -> tuple[float, float]:
    """Least and most of all finite values with a margin; where an end is asked for, that."""
    known = np.concatenate([v[np.isfinite(v)] for v in values]) if values else np.zeros(0)
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    room = MARGIN * (high - low) or max(MARGIN * abs(high), 1e-9 if known.size and high else MARGIN)
    low, high = low - room, high + room
    if asked is not None:
        low, high = (found if np.isnan(own) else own for own, found in zip(asked, (low, high), strict=True))
    return (low, high) if high > low else (low, low + 1.0)
