"""The tutorial's commands as they stand in docs/tutorial.md, from an empty folder to the report; picks by a browser.

VIDTRACK_SHOTS=docs/images python -m pytest tests/whole_workflow/test_tutorial.py    makes the tutorial's pictures anew
VIDTRACK_BIN=ENVIRONMENT/bin ...    with the vidtrack of another environment, such as one of a wheel
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.picking.browser import choose, drag, needs_browser, open_page, pick, wait
from tests.whole_workflow.pictures_of_steps import SHOTS, films, page_of, shot, terminal

REPO = Path(__file__).parents[2]
CAMERAS = ("cam1", "cam2", "cam3")
TAGS = {"calib-front": "1-12", "calib-middle": "13-24", "calib-rear": "25-36"}


def commands():
    """The tutorial's blocks of shell commands."""
    return re.findall(r"^```sh\n(.*?)^```", (REPO / "docs/tutorial.md").read_text(), re.MULTILINE | re.DOTALL)


INSTALLED = os.environ.get("VIDTRACK_BIN")
"""The folder of an installed `vidtrack`: the tutorial as a newcomer has it, without anything of this repository."""


def environment(folder):
    """`vidtrack` on the PATH, and nothing else of this project."""
    if INSTALLED:
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return {**kept, "PATH": f"{INSTALLED}{os.pathsep}/usr/bin{os.pathsep}/bin", "OMP_NUM_THREADS": "1"}
    binaries = folder / "bin"
    binaries.mkdir(exist_ok=True)
    script = f'#!/bin/sh\nexec {sys.executable} -m vidtrack.command "$@"\n'
    (binaries / "vidtrack").write_text(script)
    (binaries / "vidtrack").chmod(0o755)
    path = f"{binaries}{os.pathsep}{os.environ['PATH']}"
    return {**os.environ, "PATH": path, "PYTHONPATH": str(REPO), "OMP_NUM_THREADS": "1"}


def shell(block, folder):
    done = subprocess.run(
        ["bash", "-euc", block], cwd=folder, env=environment(folder), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, block + done.stdout + done.stderr
    return done.stdout + done.stderr


def picks_of(folder):
    """What a person sees in the pictures: where four balls of each camera are, px."""
    table = pd.read_csv(folder / "studio/calibration/front/picks.csv", dtype={"tag": str})
    return {camera: rows.set_index("tag")[["Xf", "Yf"]] for camera, rows in table.groupby("camera")}


def pick_by_hand(folder):
    """Step 4, as the tutorial says it."""
    own = environment(folder)
    command = [shutil.which("vidtrack", path=own["PATH"]), "pick", "my-lab", "--no-browser"]
    with subprocess.Popen(command, cwd=folder, env=own, stdout=subprocess.PIPE, text=True) as server:
        try:
            address = server.stdout.readline().removeprefix("the page: ").strip()
            with open_page(address) as (page, troubles):
                for clip, tags in TAGS.items():
                    choose(page, f"clip {clip}/cam1")
                    page.fill("#tags", tags)
                    page.keyboard.press("Tab")
                    wait(
                        page,
                        f"() => document.querySelector('#tag').length === 12 && '{clip}' in vidtrack.state.tagTexts",
                    )
                page.click("#save")
                wait(page, "() => document.querySelector('#status').textContent === 'saved'")
                for camera, where in picks_of(folder).items():
                    choose(page, f"clip calib-front/{camera}")
                    for tag, (x, y) in where.iterrows():
                        pick(page, tag, x, y)
                        if tag == "3" and camera == "cam1":
                            shot(page, "pick-tag")
                    wait(page, "() => document.querySelector('#named').textContent.includes(' px rms')")
                    if camera == "cam1":
                        shot(page, "pick-named")
                page.click("#save")
                wait(page, "() => document.querySelector('#plan').textContent.includes(' x calibrate')")
                if SHOTS:
                    shot_of_a_box(page)
                assert troubles == []
        finally:
            server.terminate()


def shot_of_a_box(page):
    """A box about the ball in one camera, and the line on which it lies in another; nothing of it is saved."""
    for camera in ("cam1", "cam2"):
        choose(page, f"run pluck/{camera}")
        given = "{...place(view()), n: 0, detect: {}, box: [0, 0, 640, 480]}"
        ask = f"async () => (await ask('/measure', {given})).blobs[0]"
        ball = page.evaluate(ask)
        if camera == "cam1":
            page.fill("#target", "ball")
            drag(page, (ball["Xf"] - 20, ball["Yf"] - 20), (ball["Xf"] + 20, ball["Yf"] + 20))
    wait(page, "() => vidtrack.state.curves.length > 0")
    shot(page, "pick-box")


@pytest.mark.slow
@needs_browser
def test_the_tutorials_commands_lead_from_an_empty_folder_to_a_trajectory(tmp_path):
    said = {}
    for block in commands():
        if "vidtrack check" in block:
            pick_by_hand(tmp_path)
        said[block.split("\n")[0]] = shell(block, tmp_path)
    if SHOTS:
        films([tmp_path / f"my-lab/pluck_{camera}.mov" for camera in CAMERAS])
        for verb in ("init", "check", "run"):
            command = next(line for line in said if line.startswith(f"vidtrack {verb}"))
            terminal(verb, command, said[command])
        page_of("report", tmp_path / "my-lab/results/report.html")
        page_of("report-run", tmp_path / "my-lab/results/report/run_pluck.html", "Position against time")
    assert "runs: pluck" in said["vidtrack init my-lab --units in --link --yes"]
    assert "sigma to expect" in said["vidtrack check my-lab"]
    assert "refused" not in said["vidtrack check my-lab"]
    assert "run pluck: good" in said["vidtrack run my-lab"]
    assert "calibration: good" in said["vidtrack run my-lab"]
    assert "report: my-lab/results/report.html" in said["vidtrack run my-lab"]
    report = Path(said["vidtrack report my-lab --print"].strip())
    assert report == tmp_path / "my-lab/results/report.html"
    assert "run_pluck.html" in report.read_text()
    assert (report.parent / "report/run_pluck.html").stat().st_size > 100_000
    located = pd.read_csv(tmp_path / "my-lab/results/runs/pluck/trajectories.csv").set_index("time_s")
    truth = pd.read_csv(tmp_path / "studio/runs/pluck/truth.csv").set_index("time_s")
    x = np.interp(located.index, truth.index, truth["x"])
    assert np.nanmean(np.abs(located["x"] - x)) < 0.05  # in; the survey's errors are 0.03, the motion is 20
    assert located["x"].notna().mean() > 0.95
    config = (tmp_path / "my-lab/config.yaml").read_text()
    assert yaml.safe_load(config)["calibration"]["clips"]["calib-rear"]["tags"] == "25-36"
    assert "#sensor: [8.8, 6.6]" in config
