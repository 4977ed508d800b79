"""A small laboratory, rendered once and processed once for all the tests that run Snakemake."""

import os
import shutil
import time
from pathlib import Path

import pytest
import yaml

from tests.whole_workflow.forked_snakemake import call

REPO = Path(__file__).parents[2]

SCENARIO = {
    "seed": 7,
    "units": "in",
    "cameras": {
        name: {"pan_deg": pan, "tilt_deg": 45, "distance": 160, "sensor": [8.8, 6.6], "f": 11.0}
        | {"Sx": sx, "kappa1": 6e-4, "centre": centre}
        for name, pan, sx, centre in (("cam1", -45, 1.02, [262.0, 233.0]), ("cam2", 45, 1.01, [249.0, 247.0]))
    },
    "picture": {"background": 24, "contrast": 200, "noise": 3, "blur_px": 0.5},
    "recording": {"rate": "30000/1001", "tape": {"codec": "mjpeg", "container": "mov"}},
    "calibration": {
        "points": {"rows": 3, "wires": 4, "balls": 3, "spacing": [18, 8, 10]},
        "frames": 3,
        "survey": {"error": 0.03},
        "clips": {
            "front": {"tags": "1-12", "picks": "1, 3, 5, 8, 10, 12"},
            "middle": {"tags": "13-24"},
            "rear": {"tags": "25-36"},
        },
    },
    "runs": {
        "pluck": {
            "start": "10:00:00:00",
            "duration_s": 2,
            "targets": {"t1": {"motion": {"oscillations": [{"along": [1, 0, 0], "amplitude": 20, "hz": 0.8}]}}},
            "reference": {"target": "t1", "column": "x_in", "rate": 30, "error": 0.06, "lead_s": 0.2},
        },
        "still": {"start": "10:05:00:00", "duration_s": 0.5, "targets": {"t1": {}}},
    },
}  # fmt: skip

CONFIG = {
    "units": "in",
    "cameras": {"cam1": {"sensor": [8.8, 6.6]}, "cam2": {"sensor": [8.8, 6.6]}},
    "calibration": {"clips": {"front": {"tags": "1-12"}, "middle": {"tags": "13-24"}, "rear": {"tags": "25-36"}}},
    "runs": {"pluck": {"targets": 1, "reference": {"value": "x_in"}}},
}


def snakemake(folder, *arguments, cores=2):
    """Snakemake run as a user runs it on a folder of their own; see forked_snakemake.py."""
    where = ["-s", str(REPO / "Snakefile"), "--directory", str(folder)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return call([*where, "--cores", str(cores), *arguments], environment, os.getcwd())


def planned(folder, *arguments):
    """The jobs that Snakemake would run now, as {rule: how many}, `all` left out."""
    answer = snakemake(folder, "-n", *arguments, "-q", "rules")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    jobs = {}
    for line in (answer.stdout + answer.stderr).splitlines():
        words = line.split()
        if len(words) == 2 and words[1].isdigit() and words[0] not in ("total", "all", "count"):
            jobs[words[0]] = int(words[1])
    return jobs


def configure(folder, config):
    (folder / "config.yaml").write_text(yaml.safe_dump(config, sort_keys=False))


@pytest.fixture(scope="session")
def processed(tmp_path_factory):
    """The laboratory after `snakemake`; not to be changed: see `laboratory`. One for all workers of a test run."""
    from vidtrack.simulate.laboratory import set_up
    from vidtrack.simulate.scenario import scenario_from

    shared = tmp_path_factory.getbasetemp()
    place = (shared.parent if "PYTEST_XDIST_WORKER" in os.environ else shared) / "processed"
    folder, done = place / "lab", place / "done"
    try:
        place.mkdir()
    except FileExistsError:
        for _ in range(3000):
            if done.exists():
                break
            time.sleep(0.1)
    else:
        set_up(scenario_from(SCENARIO, "scenario"), str(folder))
        configure(folder, CONFIG)
        answer = snakemake(folder)
        done.write_text("" if answer.returncode == 0 else answer.stdout + answer.stderr)
    assert done.read_text() == ""
    return folder


@pytest.fixture
def laboratory(processed, tmp_path):
    """A copy of the processed laboratory, dates and all, that a test may change."""
    folder = tmp_path / "lab"
    shutil.copytree(processed, folder, copy_function=shutil.copy2)
    return folder
