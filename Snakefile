# vidtrack: from recordings to positions. This page is the table of contents; the rules are in workflow/rules.
import os
import subprocess
import sys
import time

sys.path.insert(0, workflow.basedir)
os.environ["PATH"] = os.path.dirname(sys.executable) + os.pathsep + os.environ["PATH"]
os.environ["PYTHONPATH"] = os.pathsep.join(
    filter(None, [workflow.basedir, os.environ.get("PYTHONPATH")])
)
# A job's arrays are small: a linear algebra library that takes every core for them only gets in the others' way.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

from vidtrack.workflow import orders
from vidtrack.errors import VidtrackError
from vidtrack.files.config_file import read_config
from vidtrack.files.experiment import profiles
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.files.records import read_json
from vidtrack.workflow.order_files import OrderBook
from vidtrack.settings import settings_from_config
from vidtrack.verdict.judgement import terminal_lines

BEGAN = time.time()


def told(function, *arguments):
    """The function's answer; where the user can mend what is wrong, one clear line and exit code 1."""
    try:
        return function(*arguments)
    except VidtrackError as error:
        sys.exit("\n".join(f"vidtrack: {problem}" for problem in error.problems))


if os.path.exists("config.yaml") or not config:
    told(read_config, "config.yaml")


configfile: "config.yaml"


SETTINGS = told(settings_from_config, config)
SCENARIO = os.path.normpath(SETTINGS.experiment) + ".yaml"
if not os.path.isdir(SETTINGS.experiment) and os.path.isfile(SCENARIO):
    print(
        f"vidtrack: {SETTINGS.experiment} is not there yet; rendering it from {SCENARIO}",
        file=sys.stderr,
    )
    if subprocess.run(
        [sys.executable, "-m", "vidtrack.simulate", SCENARIO, SETTINGS.experiment]
    ).returncode:
        sys.exit(1)
EXPERIMENT = told(checked_experiment, SETTINGS)
RESULTS = EXPERIMENT.results
BOOK = OrderBook(RESULTS, writing=workflow.is_main_process)


def placed(*arguments):
    """The path of a job's order: see OrderBook.place."""
    return told(BOOK.place, *arguments)


include: "workflow/rules/tracking.smk"
include: "workflow/rules/calibration.smk"
include: "workflow/rules/location.smk"
include: "workflow/rules/comparison.smk"
include: "workflow/rules/verdict.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/planning.smk"


told(BOOK.close)


wildcard_constraints:
    camera="[^/]+",
    run="[^/]+",


rule all:
    default_target: True
    input:
        CENTROIDS,
        CALIBRATION,
        LOCATIONS,
        COMPARISONS,
        FORETOLD,
        VERDICT,
        f"{RESULTS}/report.html",


def print_verdict():
    """What verdict.json says, a line for the calibration and for each run, worst first, last on the terminal."""
    if os.path.exists(VERDICT) and os.path.getmtime(VERDICT) >= BEGAN:
        print(*terminal_lines(read_json(VERDICT)), sep="\n", file=sys.stderr)
        print(f"vidtrack: report: {RESULTS}/report.html", file=sys.stderr)


onsuccess:
    print_verdict()


onerror:
    told_lines = []
    for folder, _, names in os.walk(f"{RESULTS}/logs"):
        for log_path in (os.path.join(folder, name) for name in sorted(names)):
            if os.path.getmtime(log_path) >= BEGAN:
                with open(log_path, encoding="utf-8") as log_file:
                    told_lines += log_file.read().splitlines()
    print(*dict.fromkeys(told_lines), sep="\n", file=sys.stderr)
    print_verdict()
