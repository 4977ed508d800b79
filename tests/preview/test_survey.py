import pytest
import yaml

from vidtrack.command import main
from vidtrack.preview.recordings import Light, Target, light_of
from vidtrack.preview.survey import Facts, _target, _times


def said(capsys):
    return capsys.readouterr().out.splitlines()


@pytest.mark.slow
def test_an_experiment_that_is_as_it_should_be_is_refused_nothing(lab, capsys):
    before = sorted(lab.rglob("*"))
    assert main(["check", str(lab)]) == 0
    lines = said(capsys)
    assert sorted(lab.rglob("*")) == before
    assert not [line for line in lines if line.startswith(("refused", "doubtful", "bad"))]
    (sigma,) = [line for line in lines if "sigma to expect" in line]
    x = float(sigma.split(" x ")[1].split(",")[0])
    assert 0.003 < x < 0.03  # in; survey errors of 0.03 in over 36 points, centroids to 0.01 px of 0.3 in
    assert any("t1 starts at (20, " in line and line.endswith("among the points") for line in lines)
    assert any("period 1.2" in line and "37 samples each" in line for line in lines)  # 0.8 Hz at 29.97 a second
    assert any(line.startswith("note: ") and "samples a period" in line for line in lines)


@pytest.mark.slow
def test_what_the_workflow_would_refuse_is_said_with_its_words_and_exit_code_1(lab, capsys):
    for clip in ("front", "middle", "rear"):
        (lab / f"calibration/{clip}/picks.csv").unlink(missing_ok=True)
    config = yaml.safe_load((lab / "config.yaml").read_text())
    config["calibration"]["clips"] = {}
    (lab / "config.yaml").write_text(yaml.safe_dump(config))
    assert main(["check", str(lab)]) == 1
    lines = said(capsys)
    refused = [line for line in lines if line.startswith("refused: ")]
    assert len(refused) == 2
    assert "cam1" in refused[0]
    assert "Name at least 4 balls" in refused[0]
    assert lines[-1] == "2 things would be refused."


def test_a_config_that_cannot_be_is_refused_before_anything_is_decoded(lab, capsys):
    (lab / "runs/pluck/cam1.mov").unlink()
    assert main(["check", str(lab)]) == 1
    assert "only camera cam2 has a recording" in said(capsys)[0]


GOOD = Target("t1", 1.0, 8.0, 150.0, 0.01, 0.0, 1.0)


@pytest.mark.parametrize(
    ("target", "codes"),
    [
        (GOOD, []),
        (GOOD._replace(contrast=20.0), ["contrast-low"]),
        (GOOD._replace(saturated=0.5), ["saturated"]),
        (GOOD._replace(diameter=3.0), ["target-small"]),
        (GOOD._replace(period=0.5), ["samples-few"]),
        (GOOD._replace(measured=0.0), ["target-unseen"]),
        (GOOD._replace(period=None), []),
    ],
)
def test_each_weakness_of_light_size_and_rate_is_named_alone(target, codes):
    found = Facts([], [])
    _target("run a, cam1", target, 2.0, 120.0, found)
    assert [finding.code for finding in found.findings] == codes
    assert all(finding.cure for finding in found.findings)


def test_contrast_is_low_where_noise_is_high():
    found = Facts([], [])
    _target("run a, cam1", GOOD, 20.0, 120.0, found)
    assert [finding.code for finding in found.findings] == ["contrast-low"]


class Coded:
    """A recording with a time code, or none."""

    def __init__(self, start, seconds=10.0):
        from types import SimpleNamespace

        base = SimpleNamespace(anchors=(1,) if start is not None else (), seconds=lambda t: (start or 0.0) + t)
        self.info, self.seconds = SimpleNamespace(time=base), seconds


@pytest.mark.parametrize(
    ("starts", "codes", "fact"),
    [
        ((100.0, 104.0), [], "all cameras share 6.0 s"),
        ((100.0, 111.0), ["no-common-time"], None),
        ((100.0, None), ["time-code-missing"], "share 10.0 s"),
        ((None, None), [], "clocks are estimated from the motion"),
    ],
)
def test_the_time_of_the_cameras_is_compared(starts, codes, fact):
    found = Facts([], [])
    _times("a", {f"cam{i}": Coded(start) for i, start in enumerate(starts)}, found)
    assert [finding.code for finding in found.findings] == codes
    assert fact is None or fact in found.facts[0][1]


def test_light_is_on_one_scale_whatever_the_depth():
    import numpy as np

    rng = np.random.default_rng(0)
    deep = np.clip(rng.normal(30 * 257, 2 * 257, (200, 200)), 0, 65535).astype(np.uint16)
    deep[50:60, 50:60] = 65535
    light = light_of(deep, 16)
    assert isinstance(light, Light)
    assert light.noise == pytest.approx(2.0, rel=0.1)
    assert light.background == pytest.approx(30, abs=0.5)
    assert light.bright == pytest.approx(255, abs=0.1)
