"""Which licences of packages are taken, and that all of those in the lock are."""

import importlib.util
import sys
from pathlib import Path

import pytest

REPO = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", REPO / ".ci/licences.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["licences"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["licences"]


@pytest.mark.parametrize(
    ("expression", "allowed"),
    [
        ("MIT", True),
        ("GPL-3.0-only", False),
        ("BSD-3-Clause AND MIT", True),
        ("MIT AND GPL-3.0-only", False),
        ("GPL-2.0-or-later OR MIT", True),
        ("Public Domain OR BSD OR GPL", True),
        ("AGPL-3.0-only OR GPL-3.0-only", False),
        ("MIT AND (Apache-2.0 OR GPL-3.0-only)", False),
        ("MITT", False),
        ("", False),
    ],
)
def test_a_licence_is_taken_where_each_part_or_one_of_those_offered_is_allowed(licences, expression, allowed):
    assert licences.is_allowed(expression) is allowed


def test_every_locked_package_has_a_licence_that_is_allowed(licences):
    rows = licences.table(licences.locked((REPO / "requirements.lock").read_text()))
    assert len(rows) > 50
    assert licences.problems(rows) == []


def test_an_unknown_and_a_forbidden_licence_are_each_reported_with_the_package(licences):
    lines = licences.problems([("one", "1.0", ""), ("other", "2.0", "AGPL-3.0-only"), ("third", "3", "MIT")])
    assert [line.split(":")[0] for line in lines] == ["one 1.0", "other 2.0"]


def test_a_lock_with_two_versions_of_a_package_lists_both(licences):
    lock = "numpy==2.4.6 ; python_full_version < '3.12' \\\n    --hash=sha256:00\nnumpy==2.5.5 \\\nuv==0.9\n"
    assert licences.locked(lock) == [("numpy", "2.4.6"), ("numpy", "2.5.5"), ("uv", "0.9")]
