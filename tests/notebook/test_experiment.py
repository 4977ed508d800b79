"""`vidtrack.load`, on the laboratory that is processed once for all tests of the whole workflow."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import vidtrack
from tests.exchange.runs import trajectories
from tests.whole_workflow.conftest import processed  # noqa: F401
from vidtrack.errors import VidtrackError
from vidtrack.files.tables import write_parquet
from vidtrack.notebook.experiment import LoadedExperiment

PAGE = Path(__file__).parents[2] / "docs/notebooks.md"


@pytest.fixture
def small(tmp_path):
    """Results of two runs, without a config.yaml."""
    for name in ("a", "b"):
        folder = tmp_path / "results/runs" / name
        folder.mkdir(parents=True)
        write_parquet(folder / "trajectories.parquet", trajectories(), units="cm", provenance={})
    return tmp_path


def test_the_page_of_the_documentation_works(processed, monkeypatch):  # noqa: F811
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 3
    monkeypatch.chdir(processed.parent)
    names: dict = {}
    for block in blocks:
        exec(block.replace('"my-lab"', '"lab"'), names)
    assert (names["unit"], names["v_unit"]) == ("in", "in/s")
    assert names["x"].sizes["time"] == len(names["table"])
    assert names["px"].shape == (1, 2)
    assert names["lab"].verdict["runs"]["pluck"]["verdict"] in ("good", "doubtful")


def test_results_alone_are_enough_and_say_their_unit(small):
    lab = vidtrack.load(small)
    assert list(lab) == ["a", "b"]
    assert lab.units == "cm"
    assert lab["a"].to_xarray()["position"].attrs["units"] == "cm"
    assert "runs: a, b" in repr(lab)


def test_nothing_is_read_before_it_is_asked_for(small):
    lab = vidtrack.load(small)
    (small / "results/runs/a/trajectories.parquet").write_bytes(b"damaged")
    assert len(lab["b"].trajectories)
    with pytest.raises(VidtrackError, match="not a Parquet table"):
        _ = lab["a"].trajectories


def test_all_runs_are_one_table(small):
    whole = vidtrack.load(small).trajectories
    assert list(whole["run"].unique()) == ["a", "b"]
    assert len(whole) == 2 * len(trajectories())
    assert whole.attrs["units"]["x"] == "cm"
    assert "run" not in vidtrack.load(small)["a"].trajectories


def test_another_name_is_refused_with_those_that_there_are(small):
    with pytest.raises(KeyError, match="there are a, b"):
        vidtrack.load(small)["pluck"]


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(VidtrackError, match="Call vidtrack run"):
        vidtrack.load(tmp_path)
    with pytest.raises(VidtrackError, match="no such folder"):
        vidtrack.load(tmp_path / "nothing")


def test_importing_vidtrack_loads_nothing_of_it():
    code = "import sys, vidtrack; print(*{'numpy', 'pandas', 'xarray', 'pydantic'} & set(sys.modules))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == []
    assert isinstance(LoadedExperiment, type)
