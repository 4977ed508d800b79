"""Jobs run with this Python and this package, and their libraries take one core each unless told otherwise."""

import os
import subprocess
import sys

from vidtrack.workflow.environment import FUNCTION, set_environment


def test_this_python_and_this_package_come_first_and_once(monkeypatch):
    here = os.path.dirname(sys.executable)
    monkeypatch.setenv("PATH", os.pathsep.join(["/a", here, "/b"]))
    monkeypatch.setenv("PYTHONPATH", "/other")
    set_environment("/house")
    assert os.environ["PATH"].split(os.pathsep) == [here, "/a", "/b"]
    assert os.environ["PYTHONPATH"].split(os.pathsep) == ["/house", "/other"]
    set_environment("/house")
    assert os.environ["PYTHONPATH"].split(os.pathsep) == ["/house", "/other"]


def test_where_python_has_another_name_rules_find_it_all_the_same(monkeypatch, tmp_path):
    """As with Debian's own python3, and where the folder's `python` is another one."""
    monkeypatch.setenv("PATH", os.environ["PATH"])
    monkeypatch.setenv("PYTHONPATH", "")
    monkeypatch.delenv(FUNCTION, raising=False)
    set_environment("/house")
    assert FUNCTION not in os.environ
    folder = tmp_path / "it's a folder"
    folder.mkdir()
    (folder / "python3").symlink_to(sys.executable)
    (folder / "python").write_text("#!/bin/sh\nexit 7\n")
    (folder / "python").chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(folder / "python3"))
    monkeypatch.setenv(FUNCTION, "")
    set_environment("/house")
    command = "printf '%s' 'an order' | python -c 'import sys; print(sys.stdin.read(), sys.argv[1:])' a 'b c'"
    said = subprocess.run(["bash", "-c", f"set -euo pipefail; {command}"], capture_output=True, text=True, check=True)
    assert said.stdout == "an order ['a', 'b c']\n"


def test_an_unset_path_has_no_empty_part(monkeypatch):
    """An empty part of PYTHONPATH or PATH would mean the folder where one happens to stand."""
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.setenv("PATH", "")
    set_environment("/house")
    assert os.environ["PYTHONPATH"] == "/house"
    assert os.environ["PATH"] == os.path.dirname(sys.executable)


def test_threads_of_libraries_are_one_unless_the_user_says_otherwise(monkeypatch):
    monkeypatch.setenv("PATH", os.environ["PATH"])
    monkeypatch.setenv("PYTHONPATH", "")
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    monkeypatch.delenv("OPENCV_FOR_THREADS_NUM", raising=False)
    set_environment("/house")
    assert [os.environ[f"{v}_NUM_THREADS"] for v in ("OMP", "OPENBLAS", "MKL")] == ["3", "1", "1"]
    assert os.environ["OPENCV_FOR_THREADS_NUM"] == "1"


def test_opencv_takes_the_number_of_its_threads_from_the_environment():
    asked = {**os.environ, "OPENCV_FOR_THREADS_NUM": "1"}
    command = [sys.executable, "-c", "import cv2; print(cv2.getNumThreads())"]
    assert subprocess.run(command, env=asked, check=True, capture_output=True, text=True).stdout.strip() == "1"
