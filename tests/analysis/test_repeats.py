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


def test_runs_of_unknown_conditions_repeat_each_other_only_as_decays_of_one_named_motion():
    unknown = {"listed": False, "H": None, "T": None}
    waves = [row(name, **unknown) for name in "ab"]
    assert repeats(waves) == [["a"], ["b"]]
    decay = {"decay": {"series": "float.heave"}, "waves": None}
    assert repeats([row(name, **unknown | {"analysis": decay}) for name in "ab"]) == [["a", "b"]]
    unnamed = {"decay": {"series": None}, "waves": None}
    assert repeats([row(name, **unknown | {"analysis": unnamed}) for name in "ab"]) == [["a"], ["b"]]
