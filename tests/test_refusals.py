"""docs/refusals.md quotes messages of the code: each quoted line is one that the code can write."""

import ast
import re
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

REPO = Path(__file__).parents[1]
GAP = r"(.{1,90}?)"
"""What a message puts in at one place: a name, a path, a number."""


def quotes():
    """The first cell of each row of the page, in parts where it leaves something out (...)."""
    rows = re.findall(r"^\| `([^`]+)` \|", (REPO / "docs/refusals.md").read_text(), re.MULTILINE)
    return [(row, [part.strip(" ;()") for part in row.split("...") if part.strip(" ;()")]) for row in rows]


@cache
def templates():
    """Every text of the code, as the fragments between what is put in; texts that are added up are one."""
    found = set()
    for path in (REPO / "vidtrack").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, (ast.JoinedStr, ast.BinOp, ast.Constant)):
                found.update(texts(node))
    return found


def texts(node):
    """The texts that a node can make, each as its fragments."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [(node.value,)]
    if isinstance(node, ast.JoinedStr):
        fragments = [""]
        for value in node.values:
            if isinstance(value, ast.Constant):
                fragments[-1] += value.value
            elif fragments[-1] or len(fragments) == 1:
                fragments.append("")
        return [tuple(fragments)]
    if isinstance(node, ast.IfExp):
        return texts(node.body) + texts(node.orelse)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return [(*a[:-1], a[-1] + b[0], *b[1:]) for a in texts(node.left) for b in texts(node.right)]
    return [("", "")]


def written_by(part, fragments):
    """Whether a text with these fragments can contain the part of a quote; the quote may begin with names of places."""
    places = [m.end() for m in re.finditer(r": ", part) if " " not in part[: m.start()].replace(": ", "")]
    return any(_contains(part[at:], fragments) for at in (0, *places))


def _contains(part, fragments):
    whole, words = " ".join(fragments), part.split()
    if sum(word in whole for word in words) < 0.4 * len(words):
        return False
    if any(part in fragment for fragment in fragments):
        return True
    for i in range(len(fragments)):
        for k in range(len(fragments[i]) + 1):
            begins = fragments[i][k:]
            if not part.startswith(begins):
                continue
            for j in range(i + 1, len(fragments)):
                middle = GAP + "".join(re.escape(text) + GAP for text in fragments[i + 1 : j])
                for n in range(len(fragments[j]) + 1):
                    ends = fragments[j][:n]
                    if part.endswith(ends) and len(begins) + len(ends) < len(part):
                        found = re.fullmatch(middle, part[len(begins) : len(part) - len(ends)])
                        if found and sum(map(len, found.groups())) < 0.6 * len(part):
                            return True
    return False


@pytest.mark.parametrize(("line", "parts"), quotes(), ids=[line[:40] for line, _ in quotes()])
def test_every_line_that_the_page_quotes_is_a_message_of_the_code(line, parts):
    missing = [part for part in parts if not any(written_by(part, fragments) for fragments in templates())]
    assert missing == []


def test_a_line_that_no_code_writes_is_noticed():
    assert not any(written_by("the balls can be called in 2 ways", fragments) for fragments in templates())
    assert written_by("tag 7 appears twice", ("tag ", " appears twice (also line ", ")"))
    assert not written_by("tag 7 appears thrice", ("tag ", " appears twice (also line ", ")"))


def test_the_page_is_in_no_row_twice():
    lines = sorted(line for line, _ in quotes())
    assert len(lines) > 15
    assert all(a != b for a, b in pairwise(lines))
