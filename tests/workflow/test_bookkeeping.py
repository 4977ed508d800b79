"""What Snakemake notes of its files, with checksums that are known already."""

import asyncio
import gc
import hashlib
from types import SimpleNamespace

from vidtrack.workflow.bookkeeping import with_known_checksums, with_plain_params, without_garbage


def file_class():
    class File(str):
        async def is_checksum_eligible(self, threshold):
            return threshold > 5

        async def checksum(self, threshold=None, force=False, algorithm=None):
            return f"read {threshold} {force}"

    return File


def noted(file, *how):
    return asyncio.run(file.checksum(*how))


def test_a_result_has_the_checksum_that_is_known_and_others_are_read():
    File, asked = file_class(), []

    def checksum_of(path):
        asked.append(path)
        if path.endswith("gone"):
            raise FileNotFoundError(path)
        return "ab12"

    with_known_checksums(File, checksum_of, "results")
    assert noted(File("results/a.json"), 10) == "sha256:ab12"
    assert noted(File("results/a.json"), 3) == "read 3 False"
    assert noted(File("results/a.json"), 10, True) == "read 10 True"
    assert noted(File("results-of-another/a.json"), 10) == "read 10 False"
    assert noted(File("results/gone"), 10) == "read 10 False"
    assert asked == ["results/a.json", "results/gone"]


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
