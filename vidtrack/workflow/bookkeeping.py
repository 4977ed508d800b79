"""What Snakemake itself does for each job, made cheaper: in a season of hundreds of runs it adds up.

Nothing that it records is another value: a checksum that is known already is not computed again.
"""

from __future__ import annotations

import gc
import json
import os
import stat
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import wraps
from types import SimpleNamespace
from typing import Any


def with_known_checksums(file_class: Any, checksum_of: Callable[[str], str], results: str) -> None:
    """Let Snakemake's files under `results` have the checksums that are kept for the state that each is in.

    It notes the checksums of all inputs of a job once for each output: a table was read five times.
    checksum_of   the SHA-256 of a file; OSError where it cannot be read
    """
    plain = file_class.checksum
    inside = f"{results}/"

    @wraps(plain)
    async def checksum(self: Any, threshold: int | None = None, force: bool = False, algorithm: Any = None) -> Any:
        if str(self).startswith(inside) and not force and algorithm is None and threshold is not None:
            with suppress(OSError):
                state = os.stat(self)
                if stat.S_ISREG(state.st_mode) and state.st_size <= threshold:
                    return f"sha256:{checksum_of(str(self))}"
        return await plain(self, threshold, force, algorithm)

    file_class.checksum = checksum


def with_checksums_of_a_job(file_class: Any, persistence: Any) -> None:
    """Let Snakemake ask for the checksums of a job's inputs once when the job has ended, not again for each output."""
    found, finished = file_class.checksum, persistence.finished
    known: dict[Any, Any] | None = None

    @wraps(found)
    async def checksum(self: Any, *how: Any, **more: Any) -> Any:
        if known is None or more:
            return await found(self, *how, **more)
        key = str(self), how
        if key not in known:
            known[key] = await found(self, *how)
        return known[key]

    async def finished_with_them(job: Any) -> None:
        nonlocal known
        known = {}
        try:
            await finished(job)
        finally:
            known = None

    file_class.checksum, persistence.finished = checksum, finished_with_them


def with_known_sizes(scheduler: Any) -> None:
    """Let Snakemake look at the sizes of a job's inputs once, when all of them are there: it chooses jobs by them.

    Else it does so for each job that waits, whenever one ends: with a hundred runs, two thousand files each time.
    """
    known: set[Any] = set()
    sizes = scheduler._input_sizes
    rewards: dict[Any, Any] = {}

    async def update_input_sizes(jobs: Iterable[Any]) -> None:
        fresh = set(jobs) - known
        known.update(fresh)
        for job in fresh:
            for path in job.input:
                sizes[path] = await path.size() if await path.exists() else None

    scheduler.update_input_sizes = update_input_sizes
    for chooser in (scheduler._scheduler, scheduler._greedy_scheduler):
        if hasattr(chooser, "job_reward"):
            chooser.job_reward = _kept(chooser.job_reward, rewards)


def _kept(reward: Callable[..., Any], rewards: dict[Any, Any]) -> Callable[..., Any]:
    def job_reward(job: Any, sizes: Any) -> Any:
        if job not in rewards:
            rewards[job] = reward(job, sizes)
        return rewards[job]

    return job_reward


def with_kept_commands(job_class: Any) -> None:
    """Let Snakemake write the shell command of a job that is ready once, and not each time that it wants it."""
    written = job_class.shellcmd.fget
    kept: dict[Any, Any] = {}

    def shellcmd(self: Any) -> Any:
        key = (self, self.attempt)
        if key not in kept:
            kept[key] = written(self)
        return kept[key]

    job_class.shellcmd = property(shellcmd)


def with_plain_params(persistence: Any) -> None:
    """Let Snakemake write the params of jobs by `repr` alone: to find that none is a table it would import pandas."""
    persistence._serialize_param_pandas = persistence._serialize_param_builtin


def with_records_at_once(module: Any) -> None:
    """Let Snakemake's module of records write their JSON by the fast encoder, which its `json.dump` never uses."""

    def dump(value: Any, file: Any) -> None:
        file.write(json.dumps(value))

    module.json = SimpleNamespace(**{**vars(json), "dump": dump})


def without_pipes(job_class: Any) -> None:
    """Let Snakemake take it that no input is a pipe or a service: else it looks among all inputs of a job for each."""
    job_class.is_pipe_or_service_input = lambda self, path: False


def with_known_signatures(*modules: Any) -> None:
    """Let Snakemake look once at which parameters a function of a rule has: it does so each time that it calls one."""
    known: dict[Any, Any] = {}
    for module in modules:
        module.get_function_params = _known_params(module.get_function_params, known)


def _known_params(found: Callable[..., Any], known: dict[Any, Any]) -> Callable[..., Any]:
    def get_function_params(function: Any) -> Any:
        key = getattr(function, "__func__", function), hasattr(function, "__self__")
        if key not in known:
            known[key] = found(function)
        return known[key]

    return get_function_params


def without_garbage() -> None:
    """Count all that is there as permanent: the graph of all jobs is no matter for the garbage collector."""
    gc.collect()
    gc.freeze()
