"""A job asks for its inputs by name: the one path, or all of them."""

import dataclasses

import pytest

from vidtrack.workflow.job import Job

JOB = Job({}, {"one": "a", "list": ["b"], "many": ["c", "d"], "none": []}, {"table": "t"})


def test_one_path_is_that_path_whether_it_stands_alone_or_in_a_list():
    assert JOB.path("one") == "a"
    assert JOB.path("list") == "b"


@pytest.mark.parametrize(("name", "n"), [("many", 2), ("none", 0)])
def test_several_paths_or_none_are_not_one(name, n):
    with pytest.raises(ValueError, match=f"input {name} has {n} paths, not one"):
        JOB.path(name)


def test_all_paths_are_a_list_of_its_own():
    assert JOB.paths("one") == ["a"]
    assert JOB.paths("many") == ["c", "d"]
    assert JOB.paths("none") == JOB.paths("never given") == []
    JOB.paths("many").append("x")
    assert JOB.paths("many") == ["c", "d"]


def test_a_job_cannot_be_changed_and_a_path_never_given_is_an_error():
    with pytest.raises(KeyError):
        JOB.path("never given")
    with pytest.raises(dataclasses.FrozenInstanceError):
        JOB.threads = 2
