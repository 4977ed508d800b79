"""Which runs and cameras take part in self-calibration; what its rules are given."""

from vidtrack.files.experiment import Experiment, Run
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow.self_orders import body_sights, self_calibrate, self_cameras, self_runs

FLOAT = {"bow": [9, 0, 3], "port": [-6, 7, 3], "mast": [0, 0, 9]}


def _settings(own):
    return settings_from_config(
        {
            "units": "in",
            "cameras": {"a": {}, "b": {}, "c": {}},
            "calibration": {"self": own} if own is not None else {},
            "runs": {"heave": {"bodies": {"float": FLOAT}}, "pluck": {"bodies": {"float": FLOAT}}, "still": {}},
        }
    )


def _experiment():
    runs = {"heave": ("b", "a"), "pluck": ("c", "b"), "still": ("a", "c")}
    return Experiment(
        ".",
        None,
        {},
        {name: Run(name, dict.fromkeys(cameras, "x"), None, None, None) for name, cameras in runs.items()},
        {},
    )


def test_a_body_alone_takes_every_run_that_has_it_and_their_cameras_in_the_order_of_the_config():
    for own in ("float", {"body": "float"}):
        assert self_runs(_settings(own), _experiment()) == ["heave", "pluck"]
        assert self_cameras(_settings(own), _experiment()) == ["a", "b", "c"]
    for key in ({"runs": ["heave"]}, {"runs": "heave"}, {"run": "heave"}):
        assert self_runs(_settings({"body": "float"} | key), _experiment()) == ["heave"]
    assert self_cameras(_settings({"body": "float", "runs": ["heave"]}), _experiment()) == ["a", "b"]
    assert self_runs(_settings(None), _experiment()) == []


def test_the_rules_are_given_the_body_and_how_the_run_is_located():
    settings, experiment = _settings({"body": "float", "runs": ["heave"], "sigma": 0.01}), _experiment()
    order = self_calibrate(settings, experiment)
    assert order["targets"]["mast"] == (0, 0, 9)
    assert (order["sigma"], order["cameras"], order["runs"]) == (0.01, ["a", "b"], ["heave"])
    assert body_sights(settings, experiment, "heave")["cameras"] == ["b", "a"]
