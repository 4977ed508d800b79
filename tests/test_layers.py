"""What the import contracts in pyproject.toml (`lint-imports`) cannot say: which libraries a room may use, and when."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "vidtrack"
ROOMS = ("analysis", "geometry", "calibration", "labelling", "tracking", "location", "timing", "motion", "shore")
FLOOR = sorted(p for room in ROOMS for p in (PACKAGE / room).rglob("*.py") if p.name != "__init__.py")
NOT_DOWNSTAIRS = {"pandas", "matplotlib", "pathlib", "logging", "os", "pyarrow", "av", "yaml", "pydantic", "snakemake"}


def libraries(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
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
