"""What the documents name exists: files, rooms, tests; and what there is, they name."""

import re
from pathlib import Path

import pytest

REPO = Path(__file__).parents[1]
DOCUMENTS = sorted([*(REPO / "docs").rglob("*.md"), REPO / "README.md"])
NAMED = re.compile(r"`((?:vidtrack|tests|workflow|benchmarks|docs|data|profiles)/[\w./-]*?)(?:::(\w+))?`")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_file_and_test_that_a_document_names_exists(document):
    for path, name in NAMED.findall(document.read_text()):
        if "results/" in path:
            continue
        assert (REPO / path).exists(), f"{document.name}: {path}"
        assert not name or f"def {name}(" in (REPO / path).read_text(), f"{document.name}: {path}::{name}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_within_the_project_leads_somewhere(document):
    for target in re.findall(r"\]\(([^)#:]+)\)", document.read_text()):
        assert (document.parent / target).exists(), f"{document.name}: {target}"


def anchors(page):
    """The anchors of a page's headings, as the site and code hosts make them."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", title.lower()).strip()) for title in titles}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_into_a_page_leads_to_a_heading_of_it(document):
    for target, anchor in re.findall(r"\]\(([\w./-]*)#([^)]+)\)", document.read_text()):
        page = document.parent / target if target else document
        assert anchor in anchors(page), f"{document.name}: {target}#{anchor}"


def test_every_picture_of_the_documentation_is_shown_and_small():
    shown = {name for page in DOCUMENTS for name in re.findall(r"!\[[^\]]+\]\((?:docs/)?([^)]+)\)", page.read_text())}
    kept = [path for path in (REPO / "docs").rglob("*") if path.suffix in (".png", ".svg", ".jpg")]
    assert {str(path.relative_to(REPO / "docs")) for path in kept} == shown
    assert all(path.stat().st_size < 250_000 for path in kept)


def test_the_table_of_rooms_lists_every_room():
    text = (REPO / "docs/house-style.md").read_text()
    rooms = {path.parent.name for path in (REPO / "vidtrack").glob("*/__init__.py")}
    assert set(re.findall(r"^\| `vidtrack/(\w+)/`", text, re.MULTILINE)) == rooms
    for path in (REPO / "vidtrack").glob("*.py"):
        if path.name not in ("__init__.py", "__main__.py"):
            assert f"`{path.name}`" in text or f"`vidtrack/{path.name}`" in text, path.name


def test_the_rooms_are_printed_in_the_order_of_the_layers():
    import tomllib

    contracts = tomllib.loads((REPO / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract.get("containers") == ["vidtrack"])
    assert "\n\n" + "".join(f"    {layer}\n" for layer in layers) in (REPO / "docs/house-style.md").read_text()


def test_every_row_of_the_table_of_kinds_names_a_test_or_a_command():
    rows = re.findall(r"^\| (?!kind|---)(.*) \|$", (REPO / "docs/trust.md").read_text(), re.MULTILINE)
    assert len(rows) >= 5
    for row in rows:
        cells = row.split(" | ")
        assert len(cells) == 3, row
        assert re.search(r"`(tests|benchmarks)/", cells[2]), row


def test_the_site_shows_every_page_and_no_other():
    import yaml

    site = yaml.safe_load((REPO / "mkdocs.yml").read_text())
    named = {page for entry in site["nav"] for page in entry.values()}
    assert named == {path.name for path in (REPO / "docs").glob("*.md")}


def test_every_page_of_the_documentation_is_reached_from_the_first():
    reached, todo = set(), ["index.md"]
    while todo:
        page = todo.pop()
        if page not in reached:
            reached.add(page)
            todo += re.findall(r"\]\(([\w-]+\.md)[)#]", (REPO / "docs" / page).read_text())
    assert reached == {path.name for path in (REPO / "docs").glob("*.md")}


def captions():
    """How the captions of the report's figures begin, in the modules that draw them."""
    found = set()
    for path in (REPO / "vidtrack/report").glob("*_page.py"):
        found |= set(re.findall(r'caption = \(?\s*f?"([^":;,({]+)', path.read_text()))
    source = (REPO / "vidtrack/report/run_figures.py").read_text()
    found |= set(re.findall(r'(?:caption = \(?|Chart\()\s*f?"([^":;,({]+)', source))
    return sorted(found)


@pytest.mark.parametrize("caption", captions())
def test_the_page_on_the_report_says_how_to_read_each_figure(caption):
    rows = re.findall(r"^\| (.*?) \|", (REPO / "docs/report.md").read_text(), re.MULTILINE)
    assert any(caption.strip().lower() in row.lower() for row in rows), caption


def test_the_captions_are_found():
    assert len(captions()) > 12
    assert "Position against time" in captions()
