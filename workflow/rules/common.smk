# What all rules share: the settings, the experiment, what each job has to do, and which results are settled.
import atexit
import hashlib
import os
import re
import sys
from pathlib import Path

import snakemake.common
import snakemake.rules
from snakemake.common import __version__ as snakemake_version
from snakemake.io import IOFile
from snakemake.settings.types import RerunTrigger

HOUSE = str(Path(str(workflow.current_basedir)).parents[1])
sys.path.insert(0, HOUSE)
from vidtrack.errors import VidtrackError
from vidtrack.files.config_file import read_config
from vidtrack.files.experiment import (
    Experiment,
    channels_path,
    files_of,
    profiles,
    within,
)
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow import (
    boarded,
    import_orders,
    orders,
    report_orders,
    self_orders,
    tag_orders,
    wand_orders,
    waved,
)
from vidtrack.workflow.bookkeeping import with_known_signatures, with_plain_params
from vidtrack.workflow.environment import set_environment
from vidtrack.workflow.fingerprint import REMEMBERED
from vidtrack.workflow.left_out import from_environment, without
from vidtrack.workflow.lock import free_of_killed, is_locked, why_locked
from vidtrack.workflow.order_book import OrderBook
from vidtrack.workflow.small_jobs import JobServer
from vidtrack.workflow.standstill import checksum_of_plan, is_finished, note_finished

set_environment(HOUSE)
with_known_signatures(snakemake.common, snakemake.rules)


def or_stop(function, *arguments):
    """The function's answer; where the user can correct what is wrong, one clear line and exit code 1."""
    try:
        return function(*arguments)
    except VidtrackError as error:
        sys.exit("\n".join(f"vidtrack: {problem}" for problem in error.problems))


if os.path.exists("config.yaml") or not config:
    or_stop(read_config, "config.yaml")


configfile: "config.yaml"


SETTINGS = or_stop(settings_from_config, config)
SCENARIO = os.path.normpath(SETTINGS.experiment) + ".yaml"
TO_RENDER = not os.path.isdir(SETTINGS.experiment) and os.path.isfile(SCENARIO)
EXPERIMENT = (
    Experiment(SETTINGS.experiment, None, {}, {}, {})
    if TO_RENDER
    else or_stop(checked_experiment, SETTINGS)
)
# Cameras that runs go on without, where an earlier call found that they fail.
LEFT_OUT = from_environment(os.environ)
WHOLE_EXPERIMENT, EXPERIMENT = EXPERIMENT, without(EXPERIMENT, LEFT_OUT)
RESULTS = EXPERIMENT.results
SELF_RUNS = self_orders.self_runs(SETTINGS, EXPERIMENT)
SELF_CAMERAS = self_orders.self_cameras(SETTINGS, EXPERIMENT)
LOGS = f"{RESULTS}/logs"
BENCHMARKS = f"{RESULTS}/.benchmarks"
# Whole: Snakemake has left the folder again when the last notes are written.
CACHE = os.path.abspath(os.path.dirname(REMEMBERED))
BOOK = OrderBook(EXPERIMENT.folder, cache=CACHE)


def order(rule, *names, parts=()):
    """The params of a rule: its job's order, a line of JSON each for settings, files and code.

    names   of the wildcards that distinguish its jobs; parts: those of a rule that has one job
    """

    def part(field):
        return lambda w: getattr(
            BOOK.order(rule, *(w[name] for name in names), *parts), field
        )

    return {field: part(field) for field in ("settings", "files", "code")}


def account(rule, *parts):
    """Where a job writes down what it made of what."""
    return BOOK.place(rule, *parts)


def results(paths):
    """An input function for results of other rules.

    paths   a path with wildcards, or a function of the wildcards that gives a path or several
    Dates count for nothing: a result that is as its account says is `ancient`; any other one makes its readers run.
    """

    def found(w):
        before_planning()
        answer = paths(w) if callable(paths) else paths.format(**dict(w.items()))
        if isinstance(answer, str):
            return settled(answer)
        return [settled(path) for path in answer]

    return found


def unless_finished(paths):
    """An input function for all that is wanted: where everything is as it was when all was done, only a file that is.

    Snakemake then finds that nothing is to be done without going through each job again. A call that lists or
    forces jobs gets all of them.
    """

    def found(w):
        before_planning()
        if may_be_finished():
            if is_finished(CACHE, plan(), ACCOUNTS, BOOK.settled):
                if not workflow.dryrun:
                    atexit.register(BOOK.save)
                return ancient(f"{HOUSE}/workflow/Snakefile")
            if not workflow.dryrun:
                atexit.register(note_what_needs_nothing)
                start_server()
        return results(paths)(w)

    return found


def start_server():
    """Whether small jobs are forked by a process that loads the libraries, from now on, while Snakemake plans."""
    global job_server
    here = workflow.local_exec and not workflow.deployment_settings.deployment_method
    if job_server is None and here and workflow.is_main_process and not workflow.touch:
        job_server = JobServer()
        atexit.register(job_server.end)
    return job_server is not None


job_server = None


def note_what_needs_nothing():
    """Note that all is done where Snakemake has planned, holding the lock, and found nothing to do."""
    planned = workflow.scheduler is not None and not len(workflow.dag)
    if planned and BOOK.settled.issuperset(ACCOUNTS):
        note_finished(CACHE, plan())
        BOOK.save()


def is_forced():
    """Whether this call runs other jobs than those that are needed, or leaves some of them out."""
    asked = workflow.dag_settings
    return any(
        (
            asked.forceall,
            asked.forcetargets,
            asked.forcerun,
            asked.until,
            asked.omit_from,
            asked.batch,
        )
    )


def may_be_finished():
    """Whether this call only asks for what is missing, of everything, by all that Snakemake looks at."""
    plain = workflow.execution_settings is not None and not workflow.touch
    of_all = set(workflow.dag_settings.targets) <= {"all"}
    of_all &= set(workflow.rerun_triggers) == set(RerunTrigger.all())
    only_some = os.environ.get("VIDTRACK_RUN") or LEFT_OUT.records or unfinished
    return (
        workflow.is_main_process
        and plain
        and of_all
        and not is_forced()
        and not only_some
    )


def plan():
    """What decides which jobs there are and what each has to do."""
    jobs = {key: BOOK.order(*key) for key in BOOK.jobs}
    return checksum_of_plan(
        f"{HOUSE}/workflow",
        snakemake_version,
        config,
        EXPERIMENT,
        OFFERED,
        sorted(jobs.items()),
    )


def listed(paths):
    """A checksum of the names of inputs: an order of them says that they are others, and nothing of where they lie."""
    names = "\n".join(os.path.relpath(path, EXPERIMENT.folder) for path in paths)
    return hashlib.sha256(names.encode()).hexdigest()[:16]


def by_run(paths):
    """Run: its results among `paths`, in their order; those of no run are left out."""
    found = {}
    for path in paths:
        part, run, *_ = os.path.relpath(path, RESULTS).split(os.sep) + [""]
        if part == "runs":
            found.setdefault(run, []).append(path)
    return found


def of_the_run(paths):
    """Those of the one run that is wanted (`vidtrack run --run`); all of them where none is named."""
    only = os.environ.get("VIDTRACK_RUN")
    if not only:
        return paths
    page = f"{RESULTS}/report/run_{only}.html"
    own = f"{RESULTS}/runs/{only}/"
    return [path for path in paths if path.startswith(own) or path == page]


def settled(path):
    whole = workflow.is_main_process and path in BOOK.settled and path not in unfinished
    return ancient(path) if whole else path


def before_planning():
    """What can be set only once Snakemake knows the jobs, and holds for a dry run too.

    Force the jobs whose account is of another order, but of which Snakemake has no record that shows it: it compares
    params with its own record, and says what changed, but a folder that was copied has none.
    """
    global prepared, unfinished
    if prepared or not workflow.is_main_process:
        return
    prepared = True
    # On this computer as many jobs run as there are cores. At Snakemake's own limit of jobs in a second, each look for a
    # job starts a timer, and each timer a look: 500 jobs took 7,700 of them, each at all jobs that were ready.
    limit = workflow.scheduling_settings.max_jobs_per_timespan
    if workflow.local_exec and limit and (limit.max_jobs, limit.timespan) == (100, 1):
        workflow.scheduling_settings.max_jobs_per_timespan = None
    # A run that fails costs that run: all jobs that do not depend on it go on.
    workflow.execution_settings.keep_going = True
    # A job that was killed left no account, and runs again without being asked for by an option.
    workflow.dag_settings.force_incomplete = True
    # Dates count for nothing: a recording from a camera whose clock is ahead is newer than all that is made of it.
    workflow.dag.check_output_mtime = accept_dates
    if not workflow.dryrun and is_locked(os.getcwd()):
        if killed := free_of_killed(os.getcwd()):
            print(
                f"vidtrack: removed the lock of a snakemake that was killed (process {killed})",
                file=sys.stderr,
            )
        else:
            atexit.register(say_why_locked, os.getcwd())
    with_plain_params(workflow.persistence)
    # Where Snakemake was killed and the job lived on, the account is good, and yet the job runs again: so do its readers.
    keys = {workflow.persistence._get_key(IOFile(path)): path for path in BOOK.settled}
    unfinished = {
        keys[key] for key in workflow.persistence._filter_incomplete_keys(keys)
    }
    for path, wanted in BOOK.unsettled().items():
        record = workflow.persistence.metadata(IOFile(path))
        shown = (
            record is not None
            and record.params is not None
            and set(record.params) != {repr(line) for line in wanted}
            and RerunTrigger.PARAMS in workflow.rerun_triggers
        )
        if not shown and (record is not None or os.path.exists(path)):
            workflow.dag.forcefiles.add(path)


prepared = False
unfinished = set()


def say_why_locked(folder):
    """Say it last, where Snakemake has refused to work."""
    if is_locked(folder):
        print(why_locked(folder), file=sys.stderr)


async def accept_dates(job, outputs):
    """In place of Snakemake's check that no output is older than an input."""


def clips_seen(clip_set, camera):
    after = clip_set == "calibration_after"
    return [
        EXPERIMENT.clips[c]
        for c in orders.clips_of(SETTINGS, EXPERIMENT, camera, after)
    ]


def of_each(clip_set, name):
    """A file of each calibrated camera."""
    return results(
        lambda w: [f"{RESULTS}/{clip_set}/{camera}/{name}" for camera in SETS[clip_set]]
    )


def one_of(names):
    """What a wildcard may be that is one of these names."""
    return "|".join(re.escape(name) for name in sorted(set(names)))


def filmed(run):
    """The cameras of a run that have a recording, and not the tracks that another program made of it."""
    own = EXPERIMENT.runs[run]
    return [camera for camera in own.videos if camera not in own.tracks]


def steady(run):
    """The cameras of a run whose background shows whether they stood still."""
    return orders.steadiness(SETTINGS, EXPERIMENT, run)["cameras"]


def recordings(run):
    return [EXPERIMENT.runs[run].videos[camera] for camera in filmed(run)]


def whole_recordings(run):
    """All files of each camera's recording."""
    return [files_of(EXPERIMENT.runs[run], camera) for camera in filmed(run)]


def calibrations(run, name, cameras=lambda run: EXPERIMENT.runs[run].videos):
    """A file of each camera's calibration, where the run is located in space; name: or a function of the camera."""
    return (
        [
            f"{RESULTS}/calibration/{c}/{name(c) if callable(name) else name}"
            for c in cameras(run)
        ]
        if MODES[run] == "space"
        else []
    )


def locating(camera):
    """The file that holds a camera by which runs are located: as a body refined it, where one does."""
    return "refined.json" if camera in SELF_CAMERAS else "camera.json"


def followed(run):
    """How the cameras of a run moved, where positions are corrected by it."""
    corrected = SETTINGS.calibration.follow and run in STEADY
    return f"{RESULTS}/runs/{run}/steadiness.parquet" if corrected else []


def own_clocks(run):
    """The clocks of a run, where sound or light shows them."""
    return f"{RESULTS}/runs/{run}/clocks.json" if run in CLOCKED else []


def of_plane(run, name):
    """A file of the camera's calibration points, where the run is located in a plane of known points."""
    plane = SETTINGS.runs[run].plane if MODES[run] == "plane" else None
    camera = next(iter(EXPERIMENT.runs[run].videos))
    return f"{RESULTS}/calibration/{camera}/{name}" if plane and plane.points else []


def of_cameras(name, cameras=lambda run: EXPERIMENT.runs[run].videos):
    """A file of each camera of a run."""
    return results(
        lambda w: [
            f"{RESULTS}/runs/{w.run}/{name.format(camera=c)}" for c in cameras(w.run)
        ]
    )


def of_lamp(run, name):
    """A file of each camera of a run, where a lamp joins the clock of other instruments to theirs."""
    cameras = EXPERIMENT.runs[run].videos if orders.lamp_of(SETTINGS, run) else []
    return [f"{RESULTS}/runs/{run}/{name.format(camera=c)}" for c in cameras]


def of_located(w, name):
    """A file of one camera's calibration, where the run is located by it."""
    own = name(w.camera) if callable(name) else name
    return f"{RESULTS}/calibration/{w.camera}/{own}" if MODES[w.run] == "space" else []


def of_wand(name, *, drop=False):
    """A file of each camera's track of the wand, or of the ball that is dropped."""

    def paths(w):
        if not WAVED:
            return []
        clip = list(WANDS)[1] if drop and WAND["drop_cameras"] else WAND["clip"]
        cameras = WAND["drop_cameras"] if drop else WAVED
        return [
            f"{RESULTS}/calibration/tracks/{clip}/{name.format(camera=c)}"
            for c in cameras
        ]

    return results(paths)


def of_boards(name):
    """A file of each camera that saw the board."""
    return results(lambda w: [f"{RESULTS}/boards/{c}/{name}" for c in BOARDED])


def surveyed(clip_set):
    """The cameras that surveyed points calibrate: not those that a board places."""
    return [camera for camera in SETS[clip_set] if camera not in PLACED_BY_BOARD]


def camera_by_board(camera):
    """Whether the lens of a camera is that of a board: the config names no other."""
    return camera in BOARDED and orders.lens_of(SETTINGS, camera) is None
