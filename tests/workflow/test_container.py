"""The recipes of the containers copy all that the package is built of, and no more than the repository has."""

import re
import tomllib
from pathlib import Path

import pytest

REPO = Path(__file__).parents[2]
PROJECT = tomllib.loads((REPO / "pyproject.toml").read_text())


def of_the_image():
    lines = re.findall(r"^COPY (.*)$", (REPO / "workflow/container/Containerfile").read_text(), re.MULTILINE)
    return {path for line in lines for path in line.split()[:-1]}


def of_apptainer():
    files = (REPO / "workflow/container/vidtrack.def").read_text().partition("%files")[2].partition("%post")[0]
    return {line.split()[0] for line in files.splitlines() if line.strip()}


@pytest.mark.parametrize("copied", [of_the_image(), of_apptainer()], ids=["OCI", "Apptainer"])
def test_what_the_wheel_is_built_of_is_copied(copied):
    build, project = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"], PROJECT["project"]
    wanted = {*build["packages"], *build["force-include"], project["readme"], *project["license-files"]}
    wanted |= {"pyproject.toml", "requirements.lock"}
    missing = {path for path in wanted if not {path, path.split("/")[0]} & copied}
    assert missing == set()
    assert all((REPO / path).exists() for path in copied)
