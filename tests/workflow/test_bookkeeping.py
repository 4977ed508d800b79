"""What Snakemake notes of its files, with checksums that are known already."""

import asyncio
import gc
import hashlib
from types import SimpleNamespace

from vidtrack.workflow.bookkeeping import (
    with_kept_commands,
    with_known_checksums,
    with_known_sizes,
    with_plain_params,
    without_garbage,
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
