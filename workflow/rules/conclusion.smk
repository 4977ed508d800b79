# What is done before the first job and after the last one.
import atexit
import subprocess

from vidtrack.files.atomic import remove_all_partial
from vidtrack.files.records import read_json
from vidtrack.verdict.judgement import terminal_lines
from vidtrack.workflow.conclusion import failures, write_without
from vidtrack.workflow.lock import note_holder
from vidtrack.workflow.small_jobs import JobServer

# Of each job that is wanted; what is made on request alone is not.
ACCOUNTS = [BOOK.place(*job) for job in BOOK.jobs if job not in OFFERED]
if workflow.is_main_process:
    or_stop(BOOK.check)


def serve_small_jobs():
    """On this computer, small jobs are forked by a process that has loaded the libraries."""
    here = workflow.local_exec and not workflow.deployment_settings.deployment_method
    if here and workflow.is_main_process and not workflow.touch:
        atexit.register(JobServer().end)


def clean_up():
    """Remove what killed writers left unfinished: no job is at work now."""
    for folder in (RESULTS, ".snakemake/vidtrack"):
        remove_all_partial(folder)


def say_verdict_last():
    """Print what verdict.json says after all that Snakemake says: a line for the calibration and each run, worst first."""
    if os.path.exists(VERDICT):
        lines = [*terminal_lines(read_json(VERDICT)), f"vidtrack: report: {REPORT}"]
        atexit.register(lambda: print(*lines, sep="\n", file=sys.stderr))


onstart:
    atexit.unregister(say_why_locked)
    note_holder(os.getcwd())
    BOOK.save()
    serve_small_jobs()


onsuccess:
    if TO_RENDER:
        again = [sys.executable, "-m", "snakemake", *sys.argv[1:]]
        sys.exit(subprocess.run(again).returncode)
    clean_up()
    BOOK.look_again()
    BOOK.save()
    if may_be_finished() and BOOK.settled.issuperset(ACCOUNTS):
        note_finished(CACHE, plan())
    if VERDICT in BOOK.settled:
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
        wanted = {"verdict": (JUDGED, VERDICT), "report": (REPORTED, REPORT)}
        write_without(
            BOOK,
            {
                rule: own
                for rule, own in wanted.items()
                if rule not in failed.values()
            },
            failures(BOOK, ((rule, path) for path, rule in failed.items())),
        )
        BOOK.save()
        say_verdict_last()
