"""The page on recordings that are not one plain file: fields, colour, several files, pages, depth.

What it measures under the cursor is where the target was drawn, in the picture that the slider says.
"""

import threading
from fractions import Fraction

import numpy as np
import pytest

from tests.files.clips import ball, make_clip
from tests.picking.browser import choose, needs_browser, open_page, screen, wait
from tests.stages.test_track_recordings import KINDS, RATE, SIZE, N, film_in_colour, levels, place
from tests.video import test_colour
from vidtrack.picking.desk import Desk
from vidtrack.picking.server import Server

pytestmark = [pytest.mark.slow, needs_browser]


def both_fields(i):
    """The top field shows a picture, the bottom field what came half a frame later."""
    picture = levels(2 * i)
    picture[1::2] = levels(2 * i + 1)[1::2]
    return picture


WHITE = (
    "() => { const c = document.createElement('canvas'), m = vidtrack.state.maskImage;"
    " c.width = m.width; c.height = m.height; const g = c.getContext('2d'); g.drawImage(m, 0, 0);"
    " return g.getImageData(0, 0, c.width, c.height).data.filter((v, i) => i % 4 === 0 && v > 0).length; }"
)
"""Pixels that the thresholded view shows."""


@pytest.fixture
def served(tmp_path, monkeypatch):
    lab = tmp_path / "lab"
    for run in ("fields", "colour", "chapters", "pages", "deep"):
        (lab / "runs" / run).mkdir(parents=True)
    make_clip(lab / "runs/fields/cam1.mkv", "ffv1", "gray", n=N // 2, size=SIZE, rate=Fraction(25), picture=both_fields)
    film_in_colour(lab / "runs/colour/cam1.mkv")
    for k in (0, 1):
        make_clip(
            lab / f"runs/chapters/cam1_{k + 1}.mkv", "ffv1", "gray", n=N // 2, size=SIZE, rate=Fraction(RATE),
            picture=lambda i, k=k: levels(N // 2 * k + i),
        )  # fmt: skip
    KINDS["pages 16 bit"](lab / "runs/pages")[0].rename(lab / "runs/pages/cam1.tif")
    KINDS["10 bit"](lab / "runs/deep")[0].rename(lab / "runs/deep/cam1.mkv")
    (lab / "config.yaml").write_text(
        "units: m\ncameras: {cam1: }\nruns:\n  fields: {detect: {fields: top}}\n"
        "  colour: {detect: {colour: {hue: 0, width: 120}}}\n  pages: {rate: 50}\n"
    )
    monkeypatch.chdir(lab)
    server = Server(Desk())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


def measured(page, n, near):
    """The centroid that the page shows for picture n with the cursor near a place."""
    page.evaluate(f"() => {{ vidtrack.state.image = null; const s = document.querySelector('#slider');"
                  f" s.value = {n}; s.oninput(); }}")  # fmt: skip
    wait(page, "() => !!vidtrack.state.image")
    page.mouse.move(5, 5)
    page.evaluate("() => { vidtrack.state.blob = null; }")
    page.mouse.move(*screen(page, *near))
    wait(page, "() => vidtrack.state.blob !== null")
    return page.evaluate("() => [vidtrack.state.blob.Xf, vidtrack.state.blob.Yf]")


def test_the_page_measures_every_kind_of_recording_where_the_target_was_drawn(served):
    where = {"colour": test_colour.place, "fields": lambda n: place(2 * n)}
    with open_page(served.address) as (page, troubles):
        for run in ("colour", "chapters", "pages", "deep", "fields"):
            choose(page, f"run {run}/cam1")
            frames = page.evaluate("() => vidtrack.state.info.frames")
            assert frames == (N // 2 if run == "fields" else N), run
            for n in (0, frames - 1, frames // 2):
                true = where.get(run, place)(n)
                off = np.abs(np.subtract(measured(page, n, true), true))
                assert off.max() < (0.2 if run == "fields" else 0.06), (run, n)  # half of the lines
    assert troubles == []


def test_polarity_threshold_and_min_pixels_are_tried_out_live(served):
    with open_page(served.address) as (page, troubles):
        choose(page, "run chapters/cam1")
        measured(page, 0, place(0))
        x, y = place(0)
        wait(page, "() => vidtrack.state.maskImage !== null")
        counts = {}
        for level in ("70", "160"):
            page.evaluate("() => { vidtrack.state.maskImage = null; }")
            page.fill("#threshold", level)
            page.keyboard.press("Enter")
            wait(page, "() => vidtrack.state.maskImage !== null")
            counts[level] = page.evaluate(WHITE)
        drawn = ball(*SIZE, x, y)
        for level, n in counts.items():
            assert abs(n - (drawn > float(level)).sum()) <= 6  # noise at the rim
        page.evaluate("() => { vidtrack.state.maskImage = null; }")
        page.select_option("#polarity", "dark")
        wait(page, "() => vidtrack.state.maskImage !== null")
        assert page.evaluate(WHITE) > SIZE[0] * SIZE[1] / 2
        page.select_option("#polarity", "bright")
        page.fill("#min_pixels", "400")
        page.keyboard.press("Enter")
        page.mouse.move(5, 5)
        page.mouse.move(*screen(page, x, y))
        wait(page, "() => document.querySelector('#count').textContent.startsWith('0 blobs')")
    assert troubles == []
