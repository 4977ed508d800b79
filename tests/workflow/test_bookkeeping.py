"""What Snakemake notes of its files, with checksums that are known already."""

import asyncio
import gc
import hashlib
import inspect
import io
import json
import re
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

from vidtrack.workflow.bookkeeping import (
    with_checksums_of_a_job,
    with_kept_commands,
    with_known_checksums,
    with_known_signatures,
    with_known_sizes,
    with_plain_params,
    with_records_at_once,
    without_garbage,
    without_pipes,
)


def file_class():
    class File(str):
        async def checksum(self, threshold=None, force=False, algorithm=None):
            return f"read {threshold} {force}"

    return File


def noted(file, *how):
    return asyncio.run(file.checksum(*how))


def test_a_result_has_the_checksum_that_is_known_and_others_are_read(tmp_path, monkeypatch):
    File, asked = file_class(), []
    monkeypatch.chdir(tmp_path)
    for folder in ("results", "results/folder", "results-of-another"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.json").write_text("number")
    with_known_checksums(File, lambda path: asked.append(path) or "ab12", "results")
    assert noted(File("results/a.json"), 10) == "sha256:ab12"
    assert noted(File("results/a.json"), 3) == "read 3 False"
    assert noted(File("results/a.json"), 10, True) == "read 10 True"
    for other in ("results-of-another/a.json", "results/gone", "results/folder"):
        assert noted(File(other), 1 << 20) == "read 1048576 False"
    assert asked == ["results/a.json"]


def test_snakemake_notes_the_same_checksum_as_by_itself(tmp_path, monkeypatch):
    from snakemake.io import _IOFile

    class Known(_IOFile):
        pass

    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "results/a").write_text("numbers")
    workflow = SimpleNamespace(iocache=SimpleNamespace(active=False))
    rule = SimpleNamespace(workflow=workflow, pathvars=SimpleNamespace(apply=str))
    read = asyncio.run(Known("results/a", rule).checksum(10))
    with_known_checksums(Known, lambda _: hashlib.sha256(b"numbers").hexdigest(), "results")
    assert asyncio.run(Known("results/a", rule).checksum(10)) == read
    assert asyncio.run(Known("results/a", rule).checksum(1)) is None
    assert asyncio.run(Known("results/gone", rule).checksum(10)) is None


def test_while_a_job_is_noted_each_checksum_is_asked_for_once_and_anew_for_the_next_one():
    asked, noted_for = [], []

    class File(str):
        async def checksum(self, threshold=None, force=False, algorithm=None):
            asked.append((str(self), threshold, algorithm))
            return f"sha256:{self}{len(asked)}"

    class Persistence:
        async def finished(self, job):
            noted_for.extend([await File(path).checksum(10) for _ in "outputs" for path in job])
            if "other" in job:
                await File("other").checksum(10, algorithm="md5")
                raise OSError("no space")

    persistence = Persistence()
    with_checksums_of_a_job(File, persistence)
    asyncio.run(persistence.finished(["a", "b"]))
    assert asked == [("a", 10, None), ("b", 10, None)]
    assert noted_for == ["sha256:a1", "sha256:b2"] * 7
    with suppress(OSError):
        asyncio.run(persistence.finished(["a", "other"]))
    assert asked[2:] == [("a", 10, None), ("other", 10, None), ("other", 10, "md5")]
    asyncio.run(File("a").checksum(10))
    asyncio.run(File("a").checksum(10))
    assert len(asked) == 7


def test_a_record_is_written_by_the_fast_encoder_with_the_bytes_of_snakemake_s_own():
    import snakemake.persistence.file as module

    record = {"input": ["runs/a'b", "ü"], "log": None, "starttime": 1.5e9, "code": {"a": [1, True]}}
    mine = SimpleNamespace(json=module.json)
    with_records_at_once(mine)
    theirs, ours = io.StringIO(), io.StringIO()
    json.dump(record, theirs)
    mine.json.dump(record, ours)
    assert ours.getvalue() == theirs.getvalue()
    assert mine.json.load is json.load
    assert mine.json.JSONDecodeError is json.JSONDecodeError
    assert json.dump is not mine.json.dump


def test_no_input_is_sought_among_pipes_since_no_rule_has_one():
    class Any:
        pass

    without_pipes(Any)
    assert Any().is_pipe_or_service_input("results/a") is False
    rules = Path(__file__).parents[2] / "workflow"
    assert not [path for path in rules.rglob("*.smk") if re.search(r"\b(pipe|service)\(", path.read_text())]


def test_the_parameters_of_a_function_are_looked_at_once_and_a_methods_without_itself():
    looked = []

    def parameters(function):
        looked.append(function)
        return inspect.signature(function).parameters

    class Memory:
        def evaluate(self, wildcards, input):
            pass

    one, other = (SimpleNamespace(get_function_params=parameters) for _ in range(2))
    with_known_signatures(one, other)
    for module in (one, other):
        for function in (Memory().evaluate, Memory.evaluate, lambda w: w, Memory().evaluate):
            assert list(module.get_function_params(function)) == list(inspect.signature(function).parameters)
    assert len(looked) == 4  # the lambda is another one each time


def test_snakemake_has_what_is_made_cheaper_here():
    import snakemake.common
    import snakemake.jobs
    import snakemake.persistence.file
    import snakemake.rules

    assert snakemake.rules.get_function_params(lambda w, input: w).keys() == {"w", "input"}
    assert snakemake.common.get_function_params(lambda w: w).keys() == {"w"}
    assert callable(snakemake.jobs.Job.is_pipe_or_service_input)
    assert callable(snakemake.persistence.file.json.dump)


def test_params_are_written_without_looking_for_tables():
    persistence = SimpleNamespace(_serialize_param_pandas=None, _serialize_param_builtin=repr)
    with_plain_params(persistence)
    assert persistence._serialize_param_pandas is repr


def test_what_is_there_is_left_alone_by_the_garbage_collector():
    before = gc.get_freeze_count()
    without_garbage()
    assert gc.get_freeze_count() > before
    gc.unfreeze()


def test_the_sizes_of_a_jobs_inputs_are_looked_at_once_and_jobs_are_chosen_by_them_as_ever():
    looked = []

    class Path(str):
        async def exists(self):
            return self != "gone"

        async def size(self):
            looked.append(str(self))
            return len(self)

    class Chooser:
        def job_reward(self, job, sizes):
            return sum(sizes[path] or 0 for path in job.input)

    jobs = [Job([Path(name) for name in names]) for names in (("a", "gone"), ("bc", "a"))]
    chooser = Chooser()
    scheduler = SimpleNamespace(_input_sizes={}, _scheduler=chooser, _greedy_scheduler=chooser)
    with_known_sizes(scheduler)
    asyncio.run(scheduler.update_input_sizes(jobs[:1]))
    asyncio.run(scheduler.update_input_sizes(jobs))
    asyncio.run(scheduler.update_input_sizes(jobs))
    assert looked == ["a", "bc", "a"]
    assert scheduler._input_sizes == {"a": 1, "gone": None, "bc": 2}
    assert [chooser.job_reward(job, scheduler._input_sizes) for job in jobs * 2] == [1, 3, 1, 3]


class Job:
    """As far as what is kept of one is asked for."""

    attempt = 1

    def __init__(self, paths):
        self.input = paths

    @property
    def shellcmd(self):
        return object()


def test_the_command_of_a_job_is_written_once_for_each_try():
    class Other(Job):
        pass

    Other.shellcmd = Job.shellcmd
    with_kept_commands(Other)
    job, another = Other([]), Other([])
    first = job.shellcmd
    assert job.shellcmd is first
    assert another.shellcmd is not first
    job.attempt = 2
    assert job.shellcmd is not first
