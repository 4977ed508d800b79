"""What the import contracts in pyproject.toml (`lint-imports`) cannot say: which libraries a room may use, and when."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "vidtrack"
ROOMS = ("analysis", "geometry", "calibration", "labelling", "tracking", "location", "timing", "motion", "shore")
ROOMS += ("steadiness", "tags")
FLOOR = sorted(p for room in ROOMS for p in (PACKAGE / room).rglob("*.py") if p.name != "__init__.py")
NOT_DOWNSTAIRS = {"pandas", "matplotlib", "pathlib", "logging", "os", "pyarrow", "av", "yaml", "pydantic", "snakemake"}


def libraries(path: Path) -> set[str]:
    """What a module imports when it runs; what only its annotations name is not loaded."""
    tree = ast.parse(path.read_text())
    tree.body = [n for n in tree.body if not (isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")]
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {a.name.split(".")[0] for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("path", FLOOR, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_rooms_of_arrays_use_no_tables_and_open_no_files(path):
    assert not libraries(path) & NOT_DOWNSTAIRS


@pytest.mark.parametrize("path", sorted((PACKAGE / "stages").glob("*.py")), ids=lambda p: p.stem)
def test_stages_open_no_files(path):
    assert not libraries(path) & {"pathlib", "os", "pyarrow", "av", "matplotlib", "yaml"}
    assert "open(" not in path.read_text()


def test_no_module_is_longer_than_350_lines():
    lines = {str(p.relative_to(PACKAGE)): p.read_text().count("\n") for p in PACKAGE.rglob("*.py")}
    assert {path: n for path, n in lines.items() if n > 350} == {}


def test_opencv_never_reads_video():
    for path in PACKAGE.rglob("*.py"):
        assert "VideoCapture" not in path.read_text(), f"{path}: OpenCV's reader returns black frames for DV"


@pytest.mark.parametrize(
    "job", sorted(p.stem for p in (PACKAGE / "jobs").glob("*.py") if p.stem not in ("__init__", "report", "overlay"))
)
def test_no_job_waits_for_a_plotting_library(job):
    heavy = {"matplotlib", "scipy.optimize", "pydantic", "snakemake"}
    code = f"import sys, vidtrack.jobs.{job}; print(*sorted({heavy} & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded == []


ROOMS_TESTED_AS_ONE = {
    "jobs": "a job reads, calls its stage, writes: tests/whole_workflow runs every one of them",
    "settings": "config.yaml is one thing, whatever the sections: tests/test_settings.py",
    "commands": "each is run as a user runs it: tests/test_command.py, tests/commands",
    "preview": "tests/preview",
}
"""Rooms whose modules need no test file each, with the reason."""

TESTED_UNDER_ANOTHER_NAME = {
    "video/decoded.py": "tests/video/test_reader.py",
    "video/recording.py": "tests/video/test_reader.py",
    **dict.fromkeys(
        ("video/joined.py", "video/mraw.py", "video/numbered.py", "video/picture_stack.py", "video/tiff_pages.py"),
        "tests/video/test_recordings_of_pictures.py",
    ),
    "video/own_stamps.py": "tests/video/test_recordings_of_pictures.py",
    "exchange/lens_files.py": "tests/exchange/test_lens.py",
    "stages/board_corners.py": "tests/stages/test_boards.py",
    "calibration/doubts.py": "tests/stages/test_calibrate.py",
    "calibration/wand/projections.py": "tests/stages/test_wand.py",
    "labelling/touching.py": "tests/stages/test_calibration_points.py",
    "location/readout_search.py": "tests/stages/test_locate_rolling.py",
    "picking/desk.py": "tests/picking/test_server.py",
}
"""Kinds of recordings are tested as the recordings that they are, the desk of the picking page by its requests; what
decides between whole solutions is tested with them."""


def computes(module: Path) -> bool:
    """Whether a module does anything: one that only declares types and constants has nothing to be tested."""
    return any(isinstance(node, ast.FunctionDef) for node in ast.walk(ast.parse(module.read_text())))


def test_every_module_that_computes_has_a_test_of_its_name():
    tests = Path(__file__).parent
    inside = [path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py") if path.stem not in ("__init__", "__main__")]
    without = [
        str(path)
        for path in inside
        if path.parts[0] not in ROOMS_TESTED_AS_ONE
        and path.as_posix() not in TESTED_UNDER_ANOTHER_NAME
        and computes(PACKAGE / path)
        and not (tests / path.with_name(f"test_{path.name}")).is_file()
    ]
    assert sorted(without) == []


def test_every_room_that_is_tested_as_one_exists_and_so_do_the_tests_named():
    for room, reason in ROOMS_TESTED_AS_ONE.items():
        assert (PACKAGE / room).is_dir()
        named = re.findall(r"tests/[\w/.]*\w", reason)
        assert named
        assert all((PACKAGE.parent / path).exists() for path in named), reason
    for module, test in TESTED_UNDER_ANOTHER_NAME.items():
        assert (PACKAGE / module).exists()
        assert (PACKAGE.parent / test).exists()
