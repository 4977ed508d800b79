"""All pages in one file: every address is there once, every link leads to one of them, and nothing is outside."""

import re

import pytest

from vidtrack.report.one_file import one_file
from vidtrack.report.page import Figure, Page, Section, Table, Verdict
from vidtrack.report.page_file import write_page

VERDICT = Verdict("good", "", [], [], [])


@pytest.fixture
def pages(tmp_path):
    table = Table("Runs", ["run"], [["a b"]], keys=["run-a b"])
    film = Figure("film", "data:image/png;base64,", link="../runs/a%20b/overlay_cam1.mp4")
    made = {
        "report.html": Page(
            "tank", (), VERDICT, [Section("runs", "Runs", tables=[table])], (), {"run-a b": "report/run_a%20b.html"}
        ),
        "report/run_a b.html": Page(
            "run", (), VERDICT, [Section("run-a b", "a b", figures=[film])], nav=[("Overview", "../report.html")]
        ),
        "report/calibration.html": Page(
            "calibration",
            (),
            VERDICT,
            [Section("camera-cam1", "cam1")],
            nav=[("Run", "run_a%20b.html"), ("Camera", "calibration.html#camera-cam1")],
        ),
    }
    texts = {}
    for address, page in made.items():
        write_page(tmp_path / "page.html", page)
        texts[address] = (tmp_path / "page.html").read_text()
    return texts


def test_every_link_leads_to_an_address_within_the_file(pages):
    whole = one_file(pages)
    ids = re.findall(r'\bid="([^"]+)"', whole)
    assert len(ids) == len(set(ids))
    links = [link for link in re.findall(r'<a [^>]*href="([^"]+)"', whole) if not link.endswith(".mp4")]
    assert {"#run_a b", "#report", "#calibration.camera-cam1"} <= set(links)
    assert all(link.startswith("#") and link[1:] in ids for link in links)


def test_films_stay_beside_the_results(pages):
    assert 'href="runs/a%20b/overlay_cam1.mp4"' in one_file(pages)


def test_script_and_style_stand_once_and_every_page_whole(pages):
    whole = one_file(pages)
    assert whole.count("<style>") == whole.count("<script>") == whole.count("</html>") == 1
    assert whole.count("<article") == whole.count("<h1>") == 3


def test_what_is_no_page_is_refused():
    with pytest.raises(ValueError, match="no page"):
        one_file({"report.html": "<p>"})
