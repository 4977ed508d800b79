"""Lines on a terminal."""

from hypothesis import given
from hypothesis import strategies as st

from vidtrack.commands.lines import broken


@given(st.lists(st.text("ab/.-0123", min_size=1, max_size=12), min_size=1, max_size=40), st.integers(20, 120))
def test_lines_are_broken_between_words_alone_and_fit(words, width):
    text = " ".join(words)
    lines = broken(text, width).split("\n")
    assert all(len(line) <= width for line in lines)
    assert " ".join(lines).split() == words


def test_a_path_longer_than_the_line_stays_whole_and_what_is_indented_stays_so():
    path = "a-folder/" * 12
    assert path in broken(f"written: {path} at last", 40).replace("\n", " ").split()
    assert broken("  pluck/cam1: one two three four", 20) == "  pluck/cam1: one\n      two three four"
