"""What is not there is empty, and one experiment's results are no other's."""

from vidtrack.results import CameraResults, Results, RunResults


def test_a_record_that_is_not_there_is_empty():
    run = RunResults(records={"locate": {"samples": 3}})
    assert run.record("locate") == {"samples": 3}
    assert run.record("bodies") == {}


def test_each_has_collections_of_its_own():
    one, other = Results(), Results()
    one.cameras["cam1"] = CameraResults()
    one.runs["pluck"] = RunResults()
    one.runs["pluck"].records["locate"] = {}
    one.failures.append({})
    assert (other.cameras, other.runs, other.failures) == ({}, {}, [])
    assert RunResults().records == {}
    assert one.cameras["cam1"].record is None
