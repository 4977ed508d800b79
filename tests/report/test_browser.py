"""Pages in a browser: what draws, what turns, what sorts, and what is printed."""

import base64
import re
import shutil
import subprocess

import cv2
import numpy as np
import pytest

from tests.report.test_live import table
from tests.report.test_space_view import results, trajectories
from vidtrack.figures.style import new_figure
from vidtrack.files.figure_files import data_uri
from vidtrack.report import live
from vidtrack.report.page import Figure, Page, Section, Table, Verdict
from vidtrack.report.page_file import write_page
from vidtrack.report.space_view import as_json, space_view

pytestmark = pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium on this machine")

NUMBERS = ["0.20 ± 0.01", "3·10⁻⁶", "–", "1/24,100", "75 %"]
WRAPPED = "<script>window.onerror = (m, s, l) => document.title = 'fault: ' + m + ' ' + l;</script>"


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A function: write a page, and run a script in it after its own; what Chromium gives for some options."""
    folder = tmp_path_factory.mktemp("pages")
    still = data_uri(new_figure()[0])
    view = space_view(results(), trajectories(), {"cam1": "#00aa00"}, "m")
    view["tracks"][0]["colour"] = "#ff00ff"
    figures = [Figure("In space", still, as_json(view)), Figure("Position", still, live.positions(table(), "m"))]
    long = Table("Many rows", ["n", "value"], [[str(i), str(i * i)] for i in range(120)], "Squares.")
    numbers = Table("Numbers", ["name", "value"], [[f"row {i}", text] for i, text in enumerate(NUMBERS)])
    section = Section("run-r", "r", tables=[numbers, long], figures=figures)
    page = Page("tank: r", (), Verdict("good", "", [], [], []), [section])

    def answer(options, script=""):
        path = folder / "page.html"
        write_page(path, page)
        text = path.read_text().replace("<head>", f"<head>{WRAPPED}", 1)
        path.write_text(text.replace("</body>", f"<script>{script}</script></body>"))
        command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync"]
        command += ["--disable-background-networking", "--disable-component-update", "--virtual-time-budget=3000"]
        command += [f"--user-data-dir={folder / 'profile'}", "--window-size=1000,2400", *options, path.as_uri()]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout

    return answer


def pixels(opened, script):
    """What the first canvas of the page shows after a script, (height, width, 4), as the page reads it itself."""
    out = (
        "const c = document.querySelector('canvas'); const s = document.createElement('pre'); s.id = 'seen';"
        "s.textContent = c.toDataURL(); document.body.append(s);"
    )
    dom = opened(["--dump-dom"], script + out)
    assert "<title>fault" not in dom
    png = dom.split('id="seen">data:image/png;base64,')[1].split("<")[0]
    return cv2.imdecode(np.frombuffer(base64.b64decode(png), np.uint8), cv2.IMREAD_UNCHANGED)


def places(picture, bgr):
    return np.argwhere((np.abs(picture[..., :3].astype(int) - bgr).max(axis=2) < 60) & (picture[..., 3] > 128))


def test_the_view_in_space_draws_camera_and_target_and_turns_by_the_keyboard(opened):
    key = "document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowLeft'}));"
    before, after = pixels(opened, ""), pixels(opened, 4 * key)
    for colour, least in (((255, 0, 255), 30), ((0, 170, 0), 60)):
        assert len(places(before, colour)) > least
        assert len(places(after, colour)) > least
    camera = [places(picture, (0, 170, 0)).mean(axis=0) for picture in (before, after)]
    assert abs(camera[0][1] - camera[1][1]) > 10


def test_the_paths_alone_fill_the_view_when_they_are_asked_for(opened):
    click = "[...document.querySelectorAll('.controls button')].find(b => b.textContent === '{}').click();"
    whole, near, back = (
        np.ptp(places(pixels(opened, script), (255, 0, 255)), axis=0).max()
        for script in ("", click.format("paths"), click.format("paths") + click.format("all"))
    )
    assert near > 1.5 * whole
    assert back == whole


def test_a_view_out_of_sight_is_drawn_when_it_comes_into_sight(opened):
    """Moved far down and made blank, it is left alone by a redraw, and drawn once it is scrolled to."""
    far = "const stage = document.querySelector('.stage'); stage.style.marginTop = '90000px';"
    far += "const first = document.querySelector('canvas'); first.width = first.width;"
    again = "window.dispatchEvent(new Event('resize'));"
    near = "stage.style.marginTop = '0'; window.dispatchEvent(new Event('scroll'));"
    assert len(places(pixels(opened, far + again), (255, 0, 255))) == 0
    assert len(places(pixels(opened, far + again + near), (255, 0, 255))) > 30


def test_tables_and_controls_have_names_for_those_who_do_not_see_them(opened):
    dom = opened(["--dump-dom"])
    assert dom.count('<div class="wrap" role="region" tabindex="0" aria-label="') == dom.count("<table")
    assert dom.count('aria-label="copy the table ') == dom.count("<table")
    assert '<input type="range" aria-label="time"' in dom


def test_the_slider_moves_the_target_and_a_lost_sample_shows_none(opened):
    slide = "const r = document.querySelector('input[type=range]'); r.value = {}; r.dispatchEvent(new Event('input'));"
    shown = [len(places(pixels(opened, slide.format(at)), (255, 0, 255))) for at in (0, 1)]
    assert shown[0] > shown[1] + 20


def test_columns_sort_by_their_values_and_tables_can_be_copied(opened):
    click = "const t = [...document.querySelectorAll('table')].find(t => t.caption.textContent === 'Numbers');"
    click += "t.tHead.rows[0].cells[1].firstChild.click();"
    report = "document.title = [...t.tBodies[0].rows].map(r => r.cells[1].textContent).join(', ') + '; '"
    report += (
        "+ t.tHead.rows[0].cells[1].getAttribute('aria-sort') + '; ' + t.parentNode.querySelector('.copy').textContent;"
    )
    dom = opened(["--dump-dom"], click + report)
    assert "<title>3·10⁻⁶, 1/24,100, 0.20 ± 0.01, 75 %, –; ascending; copy</title>" in dom


def test_every_picture_and_view_has_words_for_those_who_do_not_see_it(opened):
    dom = opened(["--dump-dom"])
    assert "<title>fault" not in dom
    assert dom.count("<canvas") == len(re.findall('<canvas role="img" tabindex="0" [^>]*aria-label="[^"]+', dom)) == 3
    assert dom.count("<img") == dom.count('alt="')


def test_print_shows_the_stills_and_whole_rows_and_no_control(opened, tmp_path):
    """The rules of print are put in force on the screen, where a script can see what they do."""
    force = "for (const s of document.styleSheets) for (const r of s.cssRules) if (r.conditionText === 'print') "
    force += "r.media.mediaText = 'screen';"
    of = "const of = (q, p) => [...new Set([...document.querySelectorAll(q)]"
    of += ".map(n => getComputedStyle(n)[p]))].join('/');"
    report = "document.title = [of('.stage', 'display'), of('.still', 'display'), of('.copy', 'display'), "
    report += "of('.wrap', 'overflowX'), of('tr', 'breakInside'), of('thead', 'display')].join(' ');"
    dom = opened(["--dump-dom"], force + of + report)
    assert "<title>none block none visible avoid table-header-group</title>" in dom
    pdf = tmp_path / "page.pdf"
    opened([f"--print-to-pdf={pdf}", "--no-pdf-header-footer"])
    assert 3 <= pdf.read_bytes().count(b"/Type /Page\n") < 12
