"""Jobs run with this Python and this package, and their libraries take one core each unless told otherwise."""

import os
import subprocess
import sys

from vidtrack.workflow.environment import set_environment


def test_this_python_and_this_package_come_first_and_once(monkeypatch):
    here = os.path.dirname(sys.executable)
    monkeypatch.setenv("PATH", os.pathsep.join(["/a", here, "/b"]))
    monkeypatch.setenv("PYTHONPATH", "/other")
    set_environment("/house")
    assert os.environ["PATH"].split(os.pathsep) == [here, "/a", "/b"]
    assert os.environ["PYTHONPATH"].split(os.pathsep) == ["/house", "/other"]
    set_environment("/house")
    assert os.environ["PYTHONPATH"].split(os.pathsep) == ["/house", "/other"]


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
