"""A small laboratory as its people leave it: rendered, not processed."""

import copy
import shutil

import pytest

from tests.whole_workflow.conftest import CONFIG, SCENARIO, configure


@pytest.fixture(scope="session")
def rendered(tmp_path_factory):
    from vidtrack.simulate.laboratory import set_up
    from vidtrack.simulate.scenario import scenario_from

    folder = tmp_path_factory.mktemp("rendered") / "lab"
    scenario = copy.deepcopy(SCENARIO)
    scenario["runs"].pop("still")
    set_up(scenario_from(scenario, "scenario"), str(folder))
    configure(folder, CONFIG)
    return folder


@pytest.fixture
def lab(rendered, tmp_path):
    """A copy that a test may change."""
    shutil.copytree(rendered, tmp_path / "lab")
    return tmp_path / "lab"
