"""What is done when jobs have failed: the verdict and the report are written of what there is, and say what failed."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence

from vidtrack.workflow.failure import failure_place, write_failure
from vidtrack.workflow.order_book import OrderBook
from vidtrack.workflow.provenance import PARTIAL

SILENT = (
    "{job} ended without a message, as a job does that is killed, or for which memory runs out. Run it again; "
    "with fewer cores if memory is short."
)


def failures(book: OrderBook, failed: Iterable[tuple[str, str]]) -> list[str]:
    """The paths of the records of all failures that stand.

    failed   the rule and the account of each job that failed just now: a record is written for those that left none
    """
    for rule, account in failed:
        if not os.path.isfile(failure_place(account)):
            job = " ".join([rule, *next((key[1:] for key in book.jobs if book.place(*key) == account), ())])
            write_failure(account, rule, [SILENT.format(job=job)])
    return [path for account in book.unsettled() if os.path.isfile(path := failure_place(account))]


def write_without(book: OrderBook, wanted: Mapping[str, tuple[Sequence[str], str]], failed: Sequence[str]) -> None:
    """Run jobs that Snakemake left out because others failed, with those of their inputs that are as they should be.

    wanted   rule: the paths of its inputs `results` and of its output (named as the rule), in their order
    failed   records of failures, inputs as well
    Their accounts say that they are partial: once the failure is corrected they run again.
    """
    made: set[str] = set()
    for rule, (inputs, output) in wanted.items():
        there = [path for path in inputs if path in book.settled or path in made]
        order = book.order(rule)
        lines = order._replace(code=order.code.replace("{", f"{{{PARTIAL},", 1))
        command = [sys.executable, "-m", "vidtrack", rule, "--account", book.place(rule)]
        command += ["--input", "results", *there, *failed, "--output", rule, output]
        done = subprocess.run(command, input="\n".join(lines), text=True, check=False)
        if done.returncode == 0:
            made.add(output)


def same_call(arguments: Sequence[str], snakefile: str, folder: str) -> list[str]:
    """The command that calls Snakemake once more with the arguments of this call.

    snakefile, folder   absolute: Snakemake has changed into the folder, where what the call named relative to another
                        one means something else
    """
    end = list(arguments).index("--") if "--" in arguments else len(arguments)
    own = [*arguments[:end], "--snakefile", snakefile, "--directory", folder]
    return [sys.executable, "-m", "snakemake", *own, *arguments[end:]]
