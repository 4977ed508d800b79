import os

import pytest

from vidtrack.workflow import fingerprint
from vidtrack.workflow.fingerprint import Checksums, Fingerprints, as_it_is


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A copy of a little package in place of the real one: jobs.a uses kernel, jobs.b does not."""
    for name, text in {
        "__init__": "",
        "jobs/__init__": "",
        "jobs/a": '"""A."""\nfrom vidtrack.kernel import f\n\ndef run():\n    """Run."""\n    return f(1)\n',
        "jobs/b": "def run():\n    from vidtrack import other\n    return other\n",
        "kernel": "def f(x):\n    return x + 1  # one\n",
        "other": "VALUE = 3\n",
    }.items():
        path = tmp_path / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    monkeypatch.setattr(fingerprint, "PACKAGE", str(tmp_path))
    return tmp_path


def edited(package, name, old, new):
    path = package / f"{name}.py"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def both():
    return Fingerprints().of("vidtrack.jobs.a"), Fingerprints().of("vidtrack.jobs.b")


def test_comments_and_docstrings_count_for_nothing(package):
    before = both()
    edited(package, "kernel", "# one", "# the next number")
    edited(package, "jobs/a", '"""Run."""', '"""Run it.\n\n    Well.\n    """')
    assert both() == before


def test_a_kernels_edit_reaches_its_users_and_nobody_else(package):
    before = both()
    edited(package, "kernel", "x + 1", "x + 2")
    after = both()
    assert after[0] != before[0]
    assert after[1] == before[1]


def test_an_import_inside_a_function_counts(package):
    before = both()
    edited(package, "other", "3", "4")
    assert both()[1] != before[1]


def test_what_is_known_of_a_module_holds_until_its_file_changes(package, tmp_path_factory, monkeypatch):
    store = str(tmp_path_factory.mktemp("cache") / "code.json")
    first = Fingerprints(store)
    value = first.of("vidtrack.jobs.a")
    first.save()
    with monkeypatch.context() as patch:
        patch.setattr(fingerprint.ast, "parse", lambda *_: pytest.fail("parsed again"))
        assert Fingerprints(store).of("vidtrack.jobs.a") == value
        another_folder = str(tmp_path_factory.mktemp("cache") / "code.json")
        assert Fingerprints(another_folder).of("vidtrack.jobs.a") == value
    edited(package, "kernel", "x + 1", "x + 22")
    after = Fingerprints(another_folder)
    assert after.of("vidtrack.jobs.a") != value
    after.save()
    with monkeypatch.context() as patch:
        patch.setattr(fingerprint.ast, "parse", lambda *_: pytest.fail("parsed again"))
        assert Fingerprints(store).of("vidtrack.jobs.a") == after.of("vidtrack.jobs.a")


def test_a_package_that_may_not_be_written_to_keeps_nothing_beside_it(package, tmp_path_factory):
    (package / "__pycache__").write_text("no folder")
    store = tmp_path_factory.mktemp("cache") / "code.json"
    first = Fingerprints(str(store))
    first.of("vidtrack.jobs.a")
    first.save()
    assert store.exists()


def test_no_two_codes_are_alike(package):
    """Values, names, operators, and where one statement ends and a block begins."""
    seen = {both()[0]}
    for old, new in [
        ("x + 1", "x - 1"),
        ("x - 1", "x - 1.0"),
        ("x - 1.0", "x - '1.0'"),
        ("x - '1.0'", "x - b'1.0'"),
        ("x - b'1.0'", "x - None"),
        ("x - None", "-x"),
        ("-x", "[x]"),
        ("[x]", "[x, x]"),
        ("[x, x]", "[[x], x]"),
        ("[[x], x]", "x[:]"),
        ("x[:]", "x[::]"),
    ]:
        edited(package, "kernel", old, new)
        seen.add(both()[0])
    assert len(seen) == 11  # the last two are one


def test_checksums_follow_content_not_dates(tmp_path):
    path, store = tmp_path / "v", str(tmp_path / "store.json")
    path.write_bytes(b"one")
    first = Checksums(store)
    value = first.of(str(path))
    first.save()
    os.utime(path, (1, 1))
    assert Checksums(store).of(str(path)) == value
    path.write_bytes(b"two")
    assert Checksums(store).of(str(path)) != value


def test_a_file_that_has_not_changed_is_not_read_again(tmp_path, monkeypatch):
    path, store = tmp_path / "v", str(tmp_path / "store.json")
    path.write_bytes(b"one")
    first = Checksums(store)
    value = first.of(str(path))
    first.save()
    monkeypatch.setattr(fingerprint.hashlib, "file_digest", lambda *_: pytest.fail("read again"))
    assert Checksums(store).of(str(path)) == value


@pytest.mark.parametrize("content", ["{", "[]", '{"v": 3}', '{"v": [1, 2, 3, 4]}', '{"v": [[1], 2]}'])
def test_a_spoilt_store_is_made_anew(tmp_path, monkeypatch, content):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "store.json").write_text(content)
    (tmp_path / "v").write_bytes(b"x")
    assert len(Checksums("store.json").of("v")) == 64
    assert len(Fingerprints("store.json").of("vidtrack.errors")) == 16


def test_a_store_in_which_a_letter_was_changed_is_not_believed(tmp_path):
    path, store = tmp_path / "v", tmp_path / "store.json"
    path.write_bytes(b"x")
    first = Checksums(str(store))
    value = first.of(str(path))
    first.save()
    store.write_text(store.read_text().replace(value, value[::-1]))
    assert Checksums(str(store)).of(str(path)) == value


def test_a_file_beside_the_modules_counts_for_those_who_use_their_room(package):
    (package / "jobs/templates").mkdir()
    (package / "jobs/templates/page.html").write_text("<p>")
    (package / "other.txt").write_text("beside")
    before = both()
    (package / "jobs/templates/page.html").write_text("<p><b>")
    after = both()
    assert before[0] != after[0]
    (package / "jobs/templates/.page.html.swp").write_text("an editor's")
    assert both() == after


def test_the_libraries_that_a_module_reaches_are_known(package):
    edited(package, "kernel", "def f(x)", "import scipy.optimize\n\n\ndef f(x)")
    assert Fingerprints().libraries("vidtrack.jobs.a") == ["scipy"]
    assert Fingerprints().libraries("vidtrack.jobs.b") == []


def test_a_file_is_as_it_is_until_it_is_written_to_or_another_is_meant(tmp_path, monkeypatch):
    for folder in ("one", "other"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a").write_text("same")
    monkeypatch.chdir(tmp_path / "one")
    before = as_it_is("a")
    assert before[0] == "a"
    assert as_it_is("a") == before
    monkeypatch.chdir(tmp_path / "other")
    assert as_it_is("a") != before
    monkeypatch.chdir(tmp_path / "one")
    (tmp_path / "one/a").write_text("other")
    assert as_it_is("a") != before
