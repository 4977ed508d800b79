import subprocess

import pytest

from vidtrack.workflow.provenance import canonical, commit, experiment_of, place, versions


def test_the_experiments_folder_is_found_from_an_account():
    for results, folder in (
        ("results", "."),
        ("data/demo/results", "data/demo"),
        ("/abs/my lab/results", "/abs/my lab"),
    ):
        assert experiment_of(place(results, "track", "pluck", "cam1")) == folder
        assert experiment_of(place(results, "report")) == folder


def test_canonical_text_does_not_depend_on_the_order_of_keys():
    assert canonical({"b": 1.0, "a": "ü\n"}) == canonical({"a": "ü\n", "b": 1.0})
    assert "\n" not in canonical({"a": "line\nbreak"})


def test_versions_are_those_installed_and_none_where_a_package_is_missing():
    import numpy

    assert versions()["numpy"] == numpy.__version__
    assert versions({"nothing": "no-such-package-at-all"}) == {"nothing": "none"}


@pytest.fixture
def checkout(tmp_path):
    def git(*arguments, where=tmp_path / "repo"):
        identity = ["-c", "user.name=n", "-c", "user.email=e@example.org"]
        return subprocess.run(
            ["git", *identity, *arguments], cwd=where, capture_output=True, text=True, check=True
        ).stdout.strip()

    (tmp_path / "repo/vidtrack").mkdir(parents=True)
    git("init", "-q")
    git("commit", "-q", "--allow-empty", "-m", "one")
    return git


def test_the_commit_is_the_one_that_git_names(checkout, tmp_path):
    """On a branch, packed away, detached, in a worktree, and where there is no checkout at all."""
    head = checkout("rev-parse", "HEAD")
    package = str(tmp_path / "repo/vidtrack")
    assert commit(package) == head
    checkout("pack-refs", "--all")
    assert commit(package) == head
    checkout("worktree", "add", "-q", "-b", "other", str(tmp_path / "tree"))
    assert commit(str(tmp_path / "tree/vidtrack")) == head
    checkout("checkout", "-q", "--detach")
    assert commit(package) == head
    assert commit(str(tmp_path / "nowhere/vidtrack")) is None
