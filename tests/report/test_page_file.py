from dataclasses import replace

from vidtrack.figures.style import new_figure
from vidtrack.files.figure_files import data_uri
from vidtrack.report.page import Figure, Page, Reason, Section, Table, Verdict
from vidtrack.report.page_file import write_page

PAGE = Page(
    "A <demo>",
    ["two cameras"],
    Verdict(
        "doubtful",
        "The calibration is doubtful.",
        [Table("Cameras", ["camera", "verdict"], [["cam1", "doubtful"]])],
        [Reason("calibration", "Calibration", "doubtful", "cam1: tags 3 & 4 swapped.", "Name them.")],
        [],
    ),
    [
        Section("calibration", "Calibration", tables=[Table("by axis", ["axis", "mean"], [["x", "0.1"]])],
                sections=[Section("camera-cam1", "cam1", figures=[Figure("overlay", "data:image/png;base64,AA==")])]),
    ],
)  # fmt: skip


def test_the_page_escapes_what_people_wrote_and_nests_its_sections(tmp_path):
    write_page(tmp_path / "r.html", PAGE)
    text = (tmp_path / "r.html").read_text()
    assert "A &lt;demo&gt;" in text
    assert "tags 3 &amp; 4 swapped" in text
    assert (
        text.index('id="verdict"')
        < text.index("What to do: Name them.")
        < text.index("<h2>Calibration</h2>")
        < text.index("<h3>cam1</h3>")
    )
    assert '<th scope="col" class="words">axis</th><th scope="col">mean</th>' in text
    assert '<td class="words">x</td><td>0.1</td>' in text
    assert '<td class="words doubtful">doubtful</td>' in text
    assert "<script src" not in text
    assert "<link" not in text


def test_the_same_figure_makes_the_same_bytes():
    def drawn():
        figure, ax = new_figure()
        ax.plot([0, 1], [0, 1])
        return data_uri(figure)

    assert drawn() == drawn()


def test_live_data_lie_in_the_page_and_cannot_end_its_script(tmp_path):
    figure = Figure("In space", "data:,", '{"name":"</script><b>"}')
    write_page(tmp_path / "r.html", replace(PAGE, sections=[Section("a", "A", figures=[figure])]))
    text = (tmp_path / "r.html").read_text()
    assert '<script type="application/json">{"name":"\\u003c/script>\\u003cb>"}</script>' in text
    assert '<img class="still" src="data:," alt="In space">' in text
