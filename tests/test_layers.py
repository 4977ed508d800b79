"""What the import contracts in pyproject.toml (`lint-imports`) cannot say: which libraries a room may use, and when."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.mirrors import ROOMS_TESTED_AS_ONE, TESTED_UNDER_ANOTHER_NAME, mirror_of

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


def test_no_job_waits_for_a_plotting_library():
    jobs = sorted(p.stem for p in (PACKAGE / "jobs").glob("*.py") if p.stem not in ("__init__", "report", "overlay"))
    heavy = {"matplotlib", "scipy.optimize", "pydantic", "snakemake"}
    code = "import sys\n" + "\n".join(
        f"import vidtrack.jobs.{job}\nprint(*('{job}: ' + name for name in {heavy} & set(sys.modules)))" for job in jobs
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded == []


def test_the_import_contracts_cover_every_room_and_have_no_exception():
    project = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    assert {contract["type"] for contract in contracts} == {"layers", "independence", "forbidden", "acyclic_siblings"}
    assert not [c["name"] for c in contracts if any(key.startswith(("ignore", "unmatched")) for key in c)]
    assert all(c["exhaustive"] is True for c in contracts if c["type"] == "layers")


def computes(module: Path) -> bool:
    """Whether a module does anything: one that only declares types and constants has nothing to be tested."""
    return any(isinstance(node, ast.FunctionDef) for node in ast.walk(ast.parse(module.read_text())))


INSIDE = [path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py") if path.stem not in ("__init__", "__main__")]


def test_every_module_that_computes_has_a_test_of_its_name():
    without = [str(path) for path in INSIDE if computes(PACKAGE / path) and not mirror_of(path).exists()]
    assert sorted(without) == []


def test_no_room_of_numbers_is_excepted():
    excepted = {*ROOMS_TESTED_AS_ONE, *(path.split("/")[0] for path in TESTED_UNDER_ANOTHER_NAME)}
    assert not excepted & {*ROOMS, "association", "verdict", "stages", "workflow", "files"}


def test_what_is_tested_under_another_name_exists_and_has_no_test_of_its_own():
    for room in ROOMS_TESTED_AS_ONE:
        assert (PACKAGE / room).is_dir()
    for module in TESTED_UNDER_ANOTHER_NAME:
        assert (PACKAGE / module).is_file()
        assert not (PACKAGE.parent / "tests" / Path(module).with_name(f"test_{Path(module).name}")).exists()
