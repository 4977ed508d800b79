import http.client
import os
import signal
import subprocess
import sys

import pytest

from vidtrack.command import main


def test_a_folder_without_a_config_is_refused(tmp_path, capsys):
    assert main(["pick", str(tmp_path), "--no-browser"]) == 1
    assert "config.yaml" in capsys.readouterr().err


def test_a_folder_without_recordings_is_refused(tmp_path, capsys):
    (tmp_path / "config.yaml").write_text("units: m\ncameras: {cam1: }\n")
    assert main(["pick", str(tmp_path), "--no-browser"]) == 1
    assert "no recording" in capsys.readouterr().err


@pytest.mark.slow
def heeds_ctrl_c():
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_the_address_is_printed_and_ctrl_c_ends_it(tmp_path):
    import cv2
    import numpy as np

    (tmp_path / "config.yaml").write_text("units: m\ncameras: {cam1: }\n")
    (tmp_path / "runs/a").mkdir(parents=True)
    cv2.imwrite(str(tmp_path / "runs/a/cam1.png"), np.zeros((40, 50), np.uint8))
    command = [sys.executable, "-m", "vidtrack.command", "pick", str(tmp_path), "--no-browser"]
    # where the tests themselves run in the background, an interrupt is ignored, and that is inherited
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ, preexec_fn=heeds_ctrl_c) as child:
        line = child.stdout.readline()
        address, token = line.removeprefix("the page: ").strip().split("?token=")
        wire = http.client.HTTPConnection(address.removeprefix("http://").rstrip("/"))
        wire.request("GET", "/frame?kind=run&name=a&camera=cam1&n=0", headers={"X-Token": token})
        assert wire.getresponse().read(2) == b"\xff\xd8"  # and its connection stays open
        child.send_signal(signal.SIGINT)
        rest = child.stdout.read()
    assert line.startswith("the page: http://127.0.0.1:")
    assert "stopped" in rest
    assert child.returncode == 0
