from vidtrack.figures.style import new_figure
from vidtrack.report.drawn import Chart, drawn


def test_a_drawing_lies_inside_the_page_beside_its_caption():
    (figure,) = drawn([Chart("a line", new_figure()[0], "{}")])
    assert figure.caption == "a line"
    assert figure.live == "{}"
    assert figure.uri.startswith("data:image/png;base64,")
