"""Drawings as SVG: nothing is lost, nothing overlaps, and the same drawing makes the same text."""

import math
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from vidtrack.figures.drawing import Axes, Drawing, new_drawing
from vidtrack.figures.svg import boxes, svg, tick_text, ticks
from vidtrack.figures.svg_paths import UNIT


def paths(text):
    """Of each path that is no fill, its absolute points in tenths of px, a list a stretch."""
    out = []
    for data in re.findall(r'<path d="([^"]*)" fill="none" stroke="#', text):
        for begin, rest in re.findall(r"M(-?\d+ -?\d+)(?:l([-\d ]*)|h0)", data):
            steps = np.array(re.findall(r"-?\d+", rest), int).reshape(-1, 2)
            out.append(np.cumsum(np.vstack([np.array(begin.split(), int), steps]), axis=0))
    return out


def test_what_is_drawn_lies_where_its_numbers_say():
    drawing = new_drawing()
    (ax,) = drawing.axes
    x, y = np.array([0.0, 1.0, np.nan, 3.0, 4.0]), np.array([2.0, -1.0, 0.0, 5.0, 5.0])
    ax.plot(x, y, "#123456")
    (box,) = boxes(drawing)
    first, second = paths(svg(drawing))
    found = np.vstack([first, second]) / UNIT
    seen = np.isfinite(x)
    assert found == pytest.approx(np.stack([box.across(x[seen]), box.down(y[seen])], 1), abs=0.051)
    assert found[:, 0].min() >= box.left
    assert found[:, 0].max() <= box.left + box.width


def test_a_sample_between_two_gaps_is_a_dot():
    drawing = new_drawing()
    drawing.axes[0].plot([0, 1, 2], [np.nan, 5.0, np.nan], "#123456")
    assert re.search(r'd="M\d+ \d+h0" fill="none" stroke="#123456"', svg(drawing))


def test_equal_scales_are_equal_across_and_down():
    for equal in ("limits", "box"):
        drawing = new_drawing(1, 2, height=2.0)
        for ax in drawing.axes:
            ax.plot([0, 10], [0, 1], "#123456")
            ax.equal = equal
        for box in boxes(drawing):
            (x0, x1), (y0, y1) = box.x, box.y
            assert box.width / (x1 - x0) == pytest.approx(box.height / (y1 - y0))
            assert (x0 <= 0, x1 >= 10, y0 <= 0, y1 >= 1) == (True,) * 4


def test_axes_lie_within_the_drawing_and_beside_each_other():
    drawing = new_drawing(3, 2, height=1.6, title="six", shared=True)
    for k, ax in enumerate(drawing.axes):
        ax.plot([0, 1], [0, 10.0 ** (3 * k)], "#123456", label="a long name of a target " * (k + 1))
        ax.ylabel, ax.xlabel, ax.legend = "y (m)", "time (s)", True
    each = boxes(drawing)
    for i, a in enumerate(each):
        assert a.left >= 0
        assert a.left + a.width <= drawing.width
        assert a.top >= 0
        assert a.top + a.height <= drawing.height
        for b in each[:i]:
            beside = a.left >= b.left + b.width or b.left >= a.left + a.width
            assert beside or a.top >= b.top + b.height or b.top >= a.top + a.height
    heights = [float(y) / UNIT for y in re.findall(r'<text x="\d+" y="(-?\d+)"', svg(drawing))]
    assert min(heights) > 0
    assert max(heights) < drawing.height


def test_names_are_text_whatever_they_hold_and_the_drawing_is_well_formed():
    drawing = new_drawing(title="<b>&")
    drawing.axes[0].plot([0, 1], [0, 1], "#123456", mark="o", label='"</svg>')
    drawing.axes[0].legend = True
    text = svg(drawing, 'a "quoted" caption')
    root = ElementTree.fromstring(text)
    assert root.get("aria-label") == 'a "quoted" caption'
    assert {"<b>&", '"</svg>'} <= {node.text for node in root.iter("text")}
    assert text == svg(drawing, 'a "quoted" caption')


@example(879609.9999999999, 1e-6, 6)
@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(3, 12))
def test_ticks_are_round_numbers_inside_that_differ_as_written(low, span, most):
    places, step = ticks(low, low + span, most)
    assert len(places) <= most + 1
    slack = 1e-6 * step + 4 * math.ulp(abs(low) + span)  # a multiple of the step is rounded as numbers of its size are
    assert all(low - slack <= v <= low + span + slack for v in places)
    assert float(f"{step:.0e}") == pytest.approx(step)
    written = [tick_text(v, step) for v in places]
    if step > 1e-6:
        assert len(set(written)) == len(written)


def test_numbers_at_ticks_have_the_decimals_of_their_step():
    assert [tick_text(v, 0.05) for v in (-0.05, 0.0, 0.1)] == ["−0.05", "0", "0.10"]
    assert tick_text(250.0, 50.0) == "250"


def test_an_axis_of_nothing_and_one_of_a_single_value_are_drawn():
    for values in ([], [3.0], [np.nan]):
        drawing = Drawing(((Axes(),),), 400, 200)
        drawing.axes[0].plot(values, values, "#123456")
        (low, high), (least, most) = drawing.axes[0].bounds()
        assert high > low
        assert most > least
        assert svg(drawing).startswith("<svg")


@pytest.mark.parametrize("span", [0.9, 1.0, 9.0, 99.0])
def test_a_name_beside_an_axis_that_equal_scales_made_longer_is_not_cut(span):
    drawing = new_drawing(1, 2, height=4.0)
    for ax in drawing.axes:
        ax.plot([-20 * span, 20 * span], [0, span / 10], "#123456")
        ax.equal, ax.ylabel = "limits", "y (in)"
    places = [float(x) / UNIT for x in re.findall(r"translate\((-?\d+) -?\d+\) rotate", svg(drawing))]
    ends = [0.0, boxes(drawing)[0].left + boxes(drawing)[0].width]
    assert len(places) == 2
    assert all(place - 11.0 >= end for place, end in zip(places, ends, strict=True))  # letters stand 11 px high
