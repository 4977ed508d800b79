import zipfile

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.workflow import shipped
from vidtrack.workflow.fingerprint import PACKAGE
from vidtrack.workflow.shipped import PLANS, SCENARIOS, example_or_file, workflow_file


def test_the_repos_own_files_are_used_where_the_package_lies_in_it():
    assert workflow_file("Snakefile") == PACKAGE.removesuffix("vidtrack") + "Snakefile"


def test_files_inside_the_package_are_used_where_it_was_installed(tmp_path, monkeypatch):
    package = tmp_path / "site-packages/vidtrack"
    (package / "shipped/workflow").mkdir(parents=True)
    (package / "shipped/workflow/Snakefile").write_text("")
    (package / "shipped/Snakefile").write_text("")
    monkeypatch.setattr(shipped, "PACKAGE", str(package))
    assert workflow_file("Snakefile") == str(package / "shipped/Snakefile")
    with pytest.raises(VidtrackError, match="not installed"):
        workflow_file("profiles", "none")


def test_a_name_that_is_no_example_and_no_file_is_refused_with_the_nearest(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in SCENARIOS:
        assert example_or_file(name, SCENARIOS).endswith(f"data/{name}.yaml")
    with pytest.raises(VidtrackError, match=r"wnad: no such file. Did you mean 'wand'"):
        example_or_file("wnad", SCENARIOS)
    with pytest.raises(VidtrackError, match=r"board.yaml: no such file.*comes with vidtrack: thesis"):
        example_or_file("board.yaml", PLANS)
    (tmp_path / "tank").write_text("")
    assert example_or_file("tank", SCENARIOS) == "tank"


@pytest.mark.slow
def test_a_wheel_holds_the_workflow(tmp_path):
    import subprocess
    import sys

    repo = PACKAGE.removesuffix("vidtrack")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)], cwd=repo, check=True
    )
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("Snakefile", "workflow/Snakefile", "workflow/rules/common.smk", "profiles/default/config.yaml"):
        assert f"vidtrack/shipped/{name}" in names
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    found = subprocess.run(
        [sys.executable, "-c", "from vidtrack.workflow.shipped import workflow_file as w; print(w('Snakefile'))"],
        cwd=tmp_path / "site", capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert found.stdout.strip() == str(tmp_path / "site/vidtrack/shipped/Snakefile")
