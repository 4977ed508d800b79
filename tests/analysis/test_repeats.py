"""Which runs repeat each other."""

from vidtrack.analysis.repeats import repeats, stated

WAVES = {"waves": {"elevation": "eta"}}


def row(run, **more):
    return {"run": run, "H": 0.1, "T": 1.2, "analysis": WAVES, **more}


def test_runs_under_the_same_conditions_with_the_same_analysis_are_repeats():
    rows = [row("a"), row("b", T=1.4), row("c", repeat="2"), row("d", analysis=None), row("e", notes="again")]
    assert repeats(rows) == [["a", "c", "e"], ["b"], ["d"]]


def test_what_is_not_stated_is_the_same_as_a_blank():
    assert repeats([{"run": "a"}, {"run": "b", "H": float("nan"), "scale": None}]) == [["a", "b"]]
    assert stated(float("nan")) is None
    assert stated("3") == 3.0
