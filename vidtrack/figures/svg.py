"""A drawing as SVG: fixed margins from the number of letters, lines thinned to what a screen can show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, log10
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.figures.drawing import INK, Axes, Drawing, Line, Picture
from vidtrack.figures.svg_paths import UNIT, moves, stretches, thinned


@dataclass(frozen=True)
class Look:
    """Sizes in px.

    letter   the width of a figure or letter of the widest usual font: labels never run into each other
    row      the height of a row of text
    x_tick, y_tick   the least room of a number at an axis
    legend   how wide a row of the legend may be, of the width of its column
    """

    font: float = 12.0
    letter: float = 7.4
    row: float = 17.0
    title: float = 22.0
    edge: float = 10.0
    gap: float = 12.0
    swatch: float = 18.0
    x_tick: float = 60.0
    y_tick: float = 20.0
    legend: float = 0.8
    faint: str = "var(--line,#d9dee4)"


LOOK = Look()

FONT = "system-ui,'Segoe UI',Roboto,'DejaVu Sans',sans-serif"


class Box(NamedTuple):
    """Where axes lie, px, and what they show; legend: how wide that may be, px."""

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]
    y_down: bool
    legend: float = 0.0

    def across(self, x: Array) -> Array:
        """x in px."""
        low, high = self.x
        return np.asarray(self.left + self.width * (x - low) / (high - low))

    def down(self, y: Array) -> Array:
        """y in px from the top."""
        low, high = self.y
        part = (y - low) / (high - low)
        return np.asarray(self.top + self.height * (part if self.y_down else 1 - part))


def svg(drawing: Drawing, alt: str = "") -> str:
    """The drawing as an <svg> for the inside of a page; alt: what a screen reader says of it."""
    width, height = (round(UNIT * v) for v in (drawing.width, drawing.height))
    out = [
        f'<svg class="still chart" role="img" aria-label="{escape(alt)}" width="{width / UNIT:g}" '
        f'height="{height / UNIT:g}" viewBox="0 0 {width} {height}" font-family="{FONT}" '
        f'font-size="{UNIT * LOOK.font:g}" fill="{INK}" stroke-linejoin="round" stroke-linecap="round">'
    ]
    if drawing.title:
        out.append(_text(drawing.width / 2, LOOK.row, drawing.title, "middle", size=1.12))
    for ax, box in zip(drawing.axes, boxes(drawing), strict=True):
        last = not drawing.shared or any(ax is own for own in drawing.grid[-1])
        out += _axes(ax, box, numbered=last)
    return "".join([*out, "</svg>"])


def boxes(drawing: Drawing) -> list[Box]:
    """Where each of the axes lies, row by row."""
    rows, columns = len(drawing.grid), len(drawing.grid[0])
    bounds = [[ax.bounds() for ax in row] for row in drawing.grid]
    if drawing.shared:
        for k in range(columns):
            ends = [bounds[i][k][0] for i in range(rows) if drawing.grid[i][k].lines or drawing.grid[i][k].xlim]
            if ends:
                same = (min(low for low, _ in ends), max(high for _, high in ends))
                for i in range(rows):
                    bounds[i][k] = (same, bounds[i][k][1])
    wide = LOOK.legend * drawing.width / columns
    tops = [max(_above(ax, wide) for ax in row) for row in drawing.grid]
    feet = [max(_below(ax, drawing.shared and i < rows - 1) for ax in row) for i, row in enumerate(drawing.grid)]
    ratios = list(drawing.ratios) or [1.0] * rows
    free = drawing.height - sum(tops) - sum(feet) - (LOOK.title if drawing.title else 0.0)
    heights = [max(free, 20.0 * rows) * ratio / sum(ratios) for ratio in ratios]
    limits = [[own for _, own in row] for row in bounds]
    for _ in range(2):  # equal scales make an axis longer, and its numbers wider
        lefts = [
            max(_beside(drawing.grid[i][k], limits[i][k], heights[i]) for i in range(rows)) for k in range(columns)
        ]
        width = (drawing.width - sum(lefts) - LOOK.gap * columns - LOOK.edge) / columns
        out, top = [], LOOK.title if drawing.title else 0.0
        for i, row in enumerate(drawing.grid):
            top, left = top + tops[i], 0.0
            for k, ax in enumerate(row):
                left += lefts[k]
                out.append(_fitted(ax, Box(left, top, width, heights[i], *bounds[i][k], ax.y_down, wide)))
                limits[i][k] = out[-1].y
                left += width + LOOK.gap
            top += heights[i] + feet[i]
    return out


def _fitted(ax: Axes, box: Box) -> Box:
    """The box with equal scales, where these are asked for."""
    (x0, x1), (y0, y1) = box.x, box.y
    scale = min(box.width / (x1 - x0), box.height / (y1 - y0))
    if ax.equal == "limits":
        half_x, half_y = box.width / scale / 2, box.height / scale / 2
        x, y = ((x0 + x1) / 2 - half_x, (x0 + x1) / 2 + half_x), ((y0 + y1) / 2 - half_y, (y0 + y1) / 2 + half_y)
        return box._replace(x=x, y=y)
    if ax.equal == "box":
        width, height = scale * (x1 - x0), scale * (y1 - y0)
        return box._replace(left=box.left + (box.width - width) / 2, width=width, height=height)
    return box


def _legend(ax: Axes) -> list[Line]:
    return [line for line in (*ax.lines, *ax.levels) if line.label] if ax.legend else []


def _legend_rows(ax: Axes, width: float) -> list[list[Line]]:
    """What the legend names, in rows no wider than the axes."""
    rows: list[list[Line]] = []
    used = width
    for line in _legend(ax):
        own = LOOK.swatch + LOOK.letter * (len(line.label) + 2)
        if used + own > width and (not rows or rows[-1]):
            rows.append([])
            used = 0.0
        rows[-1].append(line)
        used += own
    return rows


def _above(ax: Axes, legend: float) -> float:
    title = LOOK.row * (1 + ax.title.count("\n")) if ax.title else 0.0
    return max(LOOK.edge, LOOK.row * len(_legend_rows(ax, legend)) + title + 4)


def _below(ax: Axes, inner: bool) -> float:
    if inner:
        return 2.0
    return (LOOK.row if ax.ticks else 0.0) + (LOOK.row if ax.xlabel else 0.0) + 4.0


def _beside(ax: Axes, limits: tuple[float, float], height: float) -> float:
    label = LOOK.row if ax.ylabel else 2.0
    if not ax.ticks:
        return label + 2.0
    places, step = _y_ticks(limits, height)
    return label + LOOK.letter * max((len(tick_text(v, step)) for v in places), default=1) + 10.0


def _x_ticks(ax: Axes, box: Box) -> tuple[list[float], float]:
    low, high = (end - ax.x_first for end in box.x)
    return ticks(low, high, max(3, min(12, int(box.width / LOOK.x_tick))))


def _y_ticks(limits: tuple[float, float], height: float) -> tuple[list[float], float]:
    return ticks(*limits, max(3, min(7, int(height / LOOK.y_tick))))


def ticks(low: float, high: float, most: int) -> tuple[list[float], float]:
    """Round values between two ends, at most so many steps of 1, 2 or 5 times a power of ten; and the step."""
    raw = (high - low) / max(most, 1)
    if not (raw > 0 and np.isfinite(raw)):
        return [low], 1.0
    power = 10.0 ** floor(log10(raw))
    step = next(s * power for s in (1, 2, 5, 10) if s * power >= raw * (1 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [k * step for k in range(first, min(last, first + 100) + 1)], step


def tick_text(value: float, step: float) -> str:
    """A tick's number with the decimals that its step needs."""
    if abs(value) < step / 1e6:
        return "0"
    decimals = max(0, -floor(log10(step) + 1e-9))
    text = f"{value:.{decimals}f}" if decimals <= 6 and abs(value) < 1e7 else f"{value:.4g}"
    return text.replace("-", "\N{MINUS SIGN}")


def _axes(ax: Axes, box: Box, numbered: bool) -> Iterator[str]:
    """The parts of one pair of axes; numbered: whether numbers and a label stand at the foot."""
    right, foot = box.left + box.width, box.top + box.height
    where = " ".join(f"{UNIT * v:.0f}" for v in (box.left, box.top, box.width, box.height))
    x, y, width, height = where.split()
    inside = f'<svg x="{x}" y="{y}" width="{width}" height="{height}" viewBox="{where}" overflow="hidden">'
    parts = [picture for own in ax.pictures for picture in _picture(own, box)]
    rules: list[str] = []
    if ax.ticks:
        x_places, x_step = ticks(
            box.x[0] - ax.x_first, box.x[1] - ax.x_first, max(3, min(12, int(box.width / LOOK.x_tick)))
        )
        y_places, y_step = _y_ticks(box.y, box.height)
        across = box.across(np.array(x_places) + ax.x_first)
        down = box.down(np.array(y_places))
        if ax.grid:
            rules += [f"M{UNIT * u:.0f} {y}v{height}" for u in across]
            rules += [f"M{x} {UNIT * v:.0f}h{width}" for v in down]
            yield f'<path d="{"".join(rules)}" style="stroke:{LOOK.faint}" stroke-width="7" fill="none"/>'
        if numbered:
            for u, value in zip(across, x_places, strict=True):
                yield _text(u, foot + LOOK.row - 3, tick_text(value, x_step), "middle")
        for v, value in zip(down, y_places, strict=True):
            yield _text(box.left - 6, v + 4, tick_text(value, y_step), "end")
    yield inside
    yield from parts
    for band in ax.bands:
        yield from _band(band.x, band.low, band.high, band.colour, box)
    for level in ax.levels:
        ends = [np.clip(v, low, high) for v, (low, high) in ((level.x, box.x), (level.y, box.y))]
        yield from _line(level._replace(x=ends[0], y=ends[1]), box)
    for line in ax.lines:
        yield from _line(line, box)
    yield "</svg>"
    for word in ax.words:
        u, v = box.across(np.array(word.x)) + word.shift[0], box.down(np.array(word.y)) + word.shift[1]
        yield _text(float(u), float(v), word.text, "start", word.colour)
    if ax.ticks:
        frame = f"M{x} {y}v{height}h{width}" if ax.grid else f"M{x} {y}v{height}h{width}v-{height}z"
        yield f'<path d="{frame}" stroke="{INK}" stroke-width="8" fill="none"/>'
    if numbered and ax.xlabel:
        down_by = (2 if ax.ticks else 1) * LOOK.row - 2
        yield _text(box.left + box.width / 2, foot + down_by, ax.xlabel, "middle")
    if ax.ylabel:
        # beyond the widest number, turned
        far = box.left - 15 - LOOK.letter * (_widest(y_places, y_step) if ax.ticks else 0)
        place = f"{UNIT * far:.0f} {UNIT * (box.top + box.height / 2):.0f}"
        yield f'<text transform="translate({place}) rotate(-90)" text-anchor="middle">{escape(ax.ylabel)}</text>'
    rows = _legend_rows(ax, box.legend)
    if ax.title:
        above = box.top - 6 - LOOK.row * len(rows)
        for k, text in enumerate(reversed(ax.title.split("\n"))):
            yield _text(box.left, above - k * LOOK.row, text, "start")
    for k, row in enumerate(rows):
        yield from _row_of_legend(row, right, box.top - 6 - LOOK.row * (len(rows) - 1 - k))


def _widest(places: Sequence[float], step: float) -> int:
    return max((len(tick_text(v, step)) for v in places), default=1)


def _row_of_legend(row: Sequence[Line], right: float, at: float) -> Iterator[str]:
    left = right - sum(LOOK.swatch + LOOK.letter * (len(line.label) + 2) for line in row)
    for line in row:
        x = np.array([left, left + LOOK.swatch])
        y = np.full(2, at - 4.0)
        if line.joined:
            yield _path(moves(np.rint(UNIT * x), np.rint(UNIT * y)), line, filled=False)
        if line.mark:
            yield _marks(np.array([x.mean()]), y[:1], line)
        yield _text(left + LOOK.swatch + 5, at, line.label, "start")
        left += LOOK.swatch + LOOK.letter * (len(line.label) + 2)


def _text(x: float, y: float, text: str, anchor: str, colour: str = INK, size: float = 1.0) -> str:
    more = "" if colour == INK else f' fill="{colour}"'
    more += "" if anchor == "start" else f' text-anchor="{anchor}"'
    more += "" if size == 1 else f' font-size="{UNIT * LOOK.font * size:.0f}"'
    return f'<text x="{UNIT * x:.0f}" y="{UNIT * y:.0f}"{more}>{escape(text)}</text>'


def _picture(own: Picture, box: Box) -> Iterator[str]:
    u, v = box.across(np.array([own.left, own.right])), box.down(np.array([own.top, own.bottom]))
    x, y, width, height = u.min(), v.min(), np.ptp(u), np.ptp(v)
    yield (
        f'<image href="{own.uri}" x="{UNIT * x:.0f}" y="{UNIT * y:.0f}" width="{UNIT * width:.0f}" '
        f'height="{UNIT * height:.0f}" preserveAspectRatio="none"/>'
    )


def _line(line: Line, box: Box) -> Iterator[str]:
    x, y = box.across(line.x), box.down(line.y)
    if line.joined:
        data = "".join(moves(*thinned(*part)) for part in stretches(x, y))
        if data:
            yield _path(data, line, filled=False)
    if line.mark:
        seen = np.isfinite(x) & np.isfinite(y)
        if seen.any():
            yield _marks(x[seen], y[seen], line)


def _path(data: str, line: Line, filled: bool) -> str:
    dash = f' stroke-dasharray="{" ".join(f"{UNIT * float(v):g}" for v in line.dash.split())}"' if line.dash else ""
    paint = f'fill="{line.colour}"' if filled else 'fill="none"'
    return f'<path d="{data}" {paint} stroke="{line.colour}" stroke-width="{UNIT * line.width:g}"{dash}/>'


def _marks(x: Array, y: Array, line: Line) -> str:
    """A mark at each point; points that lie on the same half px are one."""
    at = np.unique(np.rint(2 * np.stack([x, y], 1)).astype(np.int64), axis=0) * UNIT // 2
    r = UNIT * line.size / 2
    if line.mark == ".":
        return _path("".join(f"M{u} {v}h0" for u, v in at.tolist()), line._replace(width=line.size, dash=""), False)
    shape = {
        "o": f"m{-r:g} 0a{r:g} {r:g} 0 1 0 {2 * r:g} 0a{r:g} {r:g} 0 1 0 {-2 * r:g} 0",
        "s": f"m{-r:g} {-r:g}h{2 * r:g}v{2 * r:g}h{-2 * r:g}z",
        "^": f"m0 {-r:g}l{r:g} {2 * r:g}h{-2 * r:g}z",
        "v": f"m0 {r:g}l{r:g} {-2 * r:g}h{-2 * r:g}z",
        "D": f"m0 {-r:g}l{r:g} {r:g}l{-r:g} {r:g}l{-r:g} {-r:g}z",
        "+": f"m{-r:g} 0h{2 * r:g}m{-r:g} {-r:g}v{2 * r:g}",
        "x": f"m{-r:g} {-r:g}l{2 * r:g} {2 * r:g}m0 {-2 * r:g}l{-2 * r:g} {2 * r:g}",
        "|": f"m0 {-r:g}v{2 * r:g}",
    }[line.mark]
    filled = not line.hollow and line.mark not in "+x|"
    return _path("".join(f"M{u} {v}{shape}" for u, v in at.tolist()), line._replace(dash=""), filled)


def _band(x: Array, low: Array, high: Array, colour: str, box: Box) -> Iterator[str]:
    across = box.across(x)
    top, bottom = (box.down(v) for v in (low, high))
    data = []
    for u, a, b in stretches(across, top, bottom):
        edges = [thinned(u, v) for v in (a, b)]
        both = [np.concatenate([one, other[::-1]]) for one, other in zip(*edges, strict=True)]
        data.append(moves(*both) + "z")
    if data:
        yield f'<path d="{"".join(data)}" fill="{colour}" fill-opacity=".2"/>'
