"""Public files of other programs, and files that other programs wrote of our numbers, as independent readers have them.

The files in `public/` are there in every clone. Others, which may not be kept, are read where they are at hand: in the
folder that VIDTRACK_PUBLIC_FILES names, or in ../shared/real/formats (benchmarks/public_formats.py says where they are
public).
"""

import os
from pathlib import Path

import pytest

from benchmarks.public_formats import FILES, KEPT, found

ELSEWHERE = Path(os.environ.get("VIDTRACK_PUBLIC_FILES") or Path(__file__).parents[2] / "../shared/real/formats")
AT_HAND = found([KEPT, ELSEWHERE])
PUBLIC = [(file, path) for file, path in AT_HAND if KEPT in path.parents and "written by" not in file.source]


@pytest.mark.parametrize(("file", "path"), AT_HAND, ids=[file.file for file, _ in AT_HAND])
def test_its_values_are_those_of_an_independent_reader(file, path):
    own = file.compare(path)
    assert own.numbers >= 40
    assert own.largest <= own.limit


def test_public_files_of_eight_formats_are_in_every_clone():
    assert len({file.format for file, _ in PUBLIC}) >= 8
    assert all((KEPT / path.relative_to(KEPT).parts[0] / "LICENSE").is_file() for _, path in PUBLIC)


def test_each_folder_is_compared():
    assert all(
        any(file.file.startswith(f"{folder.name}/") for file in FILES) for folder in KEPT.iterdir() if folder.is_dir()
    )
