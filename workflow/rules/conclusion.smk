# What is done before the first job and after the last one.
import atexit
import importlib
import subprocess

import snakemake.persistence.file
from snakemake.jobs import Job

from vidtrack.files.atomic import remove_all_partial
from vidtrack.files.records import read_json
from vidtrack.verdict.judgement import of_earlier_call, terminal_lines
from vidtrack.workflow.bookkeeping import (
    with_checksums_of_a_job,
    with_kept_commands,
    with_known_checksums,
    with_known_sizes,
    with_records_at_once,
    without_garbage,
    without_pipes,
)
from vidtrack.workflow.conclusion import failures, same_call, write_without
from vidtrack.workflow.direct_jobs import for_shell_commands, with_places
from vidtrack.workflow.left_out import also_left_out, to_environment
from vidtrack.workflow.lock import note_holder
from vidtrack.workflow.outdated import forget, note, outdated, record

# Of each job that is wanted; what is made on request alone is not.
ACCOUNTS = [BOOK.place(*job) for job in BOOK.jobs if job not in OFFERED]
if workflow.is_main_process:
    or_stop(BOOK.check)


def serve_small_jobs():
    """On this computer, small jobs are forked by a process that has loaded the libraries."""
    if start_server():
        starts = ("snakemake.shell", "snakemake.benchmark")
        places = with_places(workflow.scheduler, workflow.cores)
        for_shell_commands(*map(importlib.import_module, starts), places)


def keep_books_cheaply():
    """What Snakemake notes of each job is the same, and costs less."""
    with_known_checksums(type(IOFile("")), BOOK.checksum, RESULTS)
    with_checksums_of_a_job(type(IOFile("")), workflow.persistence)
    with_records_at_once(snakemake.persistence.file)
    without_pipes(Job)
    with_known_sizes(workflow.scheduler)
    with_kept_commands(Job)
    without_garbage()


def clean_up():
    """Remove what killed writers left unfinished: no job is at work now."""
    for folder in (RESULTS, ".snakemake/vidtrack"):
        remove_all_partial(folder)


def call_again(environment):
    """This same call once more; its exit code."""
    again = same_call(sys.argv[1:], workflow.main_snakefile, os.getcwd())
    return subprocess.run(again, env=environment).returncode


def go_on_without(records):
    """Locate runs without cameras that failed, where two others are left; whether another call did so."""
    left = also_left_out(SETTINGS, WHOLE_EXPERIMENT, LEFT_OUT, records)
    if left == LEFT_OUT or is_forced():
        return False
    for run in WHOLE_EXPERIMENT.runs:
        for camera, why in left.of_run(run).items():
            print(
                f"vidtrack: run {run}: going on without {camera}: {why}",
                file=sys.stderr,
            )
    BOOK.save()
    workflow.persistence.unlock()
    call_again(to_environment(left))
    return True


def say_verdict_last():
    """Print what verdict.json says after all that Snakemake says: a line for the calibration and each run, worst first."""
    if os.path.exists(VERDICT):
        lines = [*terminal_lines(read_json(VERDICT)), f"vidtrack: report: {REPORT}"]
        atexit.register(lambda: print(*lines, sep="\n", file=sys.stderr))


def say_what_is_outdated():
    """Note and print which results are of earlier settings, and were not wanted from this call."""
    note(RESULTS, places := outdated(BOOK))
    if places:
        print(f"vidtrack: {of_earlier_call(places)}", file=sys.stderr)


onstart:
    atexit.unregister(say_why_locked)
    note_holder(os.getcwd())
    BOOK.save()
    serve_small_jobs()
    keep_books_cheaply()


onsuccess:
    if TO_RENDER:
        sys.exit(call_again(os.environ))
    clean_up()
    BOOK.look_again()
    BOOK.save()
    if may_be_finished() and BOOK.settled.issuperset(ACCOUNTS):
        note_finished(CACHE, plan())
    forget(RESULTS)
    say_what_is_outdated()
    if LEFT_OUT.records or VERDICT in BOOK.settled:
        say_verdict_last()


onerror:
    clean_up()
    failed = {
        job.output.account: job.rule.name
        for job in workflow.scheduler.failed
        if hasattr(job.output, "account")
    }
    if failed:  # and not stopped by the user
        BOOK.look_again()
        records = failures(BOOK, ((rule, path) for path, rule in failed.items()))
        if not go_on_without(records):
            note(RESULTS, places := outdated(BOOK))
            wanted = {"verdict": (JUDGED, VERDICT), "report": (REPORTED, REPORT)}
            write_without(
                BOOK,
                {
                    rule: own
                    for rule, own in wanted.items()
                    if rule not in failed.values()
                },
                [*records, *record(RESULTS, places)],
            )
            BOOK.save()
            say_verdict_last()
