"""The house holds: data flows one way, only the doors open paths, nobody walks in circles."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "vidtrack"
ROOMS = ("calibration", "labelling", "tracking", "location", "timing", "motion", "shore", "telling")
FLOOR = sorted(p for place in (".", *ROOMS) for p in (PACKAGE / place).glob("*.py") if p.name != "__init__.py")
HALL = {"entry", "__main__", "orders", "settings", "job", "progress"}
"""Modules of the entrance: they know paths or settings, and no ground floor module knows them."""
NOT_DOWNSTAIRS = {"pandas", "matplotlib", "pathlib", "logging", "os", "pyarrow", "av", "yaml", "pydantic", "snakemake"}


def imports(path: Path, *, top_level_only: bool = False) -> set[str]:
    tree = ast.parse(path.read_text())
    nodes = tree.body if top_level_only else list(ast.walk(tree))
    names: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{a.name}" for a in node.names}
    return names


def module_name(path: Path) -> str:
    return ".".join(("vidtrack", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


ALL = {module_name(p): p for p in PACKAGE.rglob("*.py")}


@pytest.mark.parametrize("path", [p for p in FLOOR if p.stem not in HALL], ids=lambda p: p.stem)
def test_the_ground_floor_knows_arrays_only(path):
    reached = imports(path)
    assert not {n.split(".")[0] for n in reached} & NOT_DOWNSTAIRS
    inside = {n for n in reached if n.startswith("vidtrack.")}
    assert not {n for n in inside if n.split(".")[1] in {"stages", "jobs", "files", "figures", "simulate", *HALL}}


@pytest.mark.parametrize("path", sorted((PACKAGE / "stages").glob("*.py")), ids=lambda p: p.stem)
def test_stages_open_no_paths_and_do_not_know_each_other(path):
    reached = imports(path)
    assert not {n.split(".")[0] for n in reached} & {"pathlib", "os", "pyarrow", "av", "matplotlib", "yaml"}
    inside = {n.split(".")[1] for n in reached if n.startswith("vidtrack.")}
    assert not inside & {"stages", "jobs", "figures", "simulate", "settings", "orders", "entry"}
    assert "open(" not in path.read_text()


@pytest.mark.parametrize("name", [n for n in ALL if ".jobs" not in n], ids=str)
def test_nobody_but_its_job_imports_a_stage(name):
    assert not {n for n in imports(ALL[name]) if n.startswith(("vidtrack.stages.", "vidtrack.jobs."))}


@pytest.mark.parametrize("name", [n for n in ALL if n.startswith("vidtrack.simulate")], ids=str)
def test_the_simulator_knows_no_estimator(name):
    inside = {n for n in imports(ALL[name]) if n in ALL and not n.startswith(("vidtrack.simulate", "vidtrack.files"))}
    known = {"vidtrack.camera", "vidtrack.errors", "vidtrack.naming", "vidtrack.progress"}
    assert inside <= known | {"vidtrack.timing.timecode", "vidtrack.timing.fields", "vidtrack.timing.frame"}, inside


def test_no_module_imports_itself_by_way_of_others():
    graph = {n: {m for m in imports(p, top_level_only=True) if m in ALL and m != n} for n, p in ALL.items()}
    done: set[str] = set()

    def visit(name: str, path: tuple[str, ...]) -> None:
        assert name not in path, " -> ".join((*path, name))
        if name not in done:
            for other in graph[name]:
                visit(other, (*path, name))
            done.add(name)

    for name in graph:
        visit(name, ())


def test_opencv_never_reads_video():
    for name, path in ALL.items():
        assert "VideoCapture" not in path.read_text(), f"{name}: OpenCV's reader returns black frames for DV"


@pytest.mark.parametrize(
    "job", sorted(p.stem for p in (PACKAGE / "jobs").glob("*.py") if p.stem not in ("__init__", "report", "overlay"))
)
def test_no_job_waits_for_a_plotting_library(job):
    heavy = {"matplotlib", "scipy.optimize", "pydantic", "snakemake"}
    code = f"import sys, vidtrack.jobs.{job}; print(*sorted({heavy} & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded == []
