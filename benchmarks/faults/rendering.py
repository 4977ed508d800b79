"""Rule `render`, which makes the experiment of a scenario: killed and stopped at a random moment, and called again.

Its folder must be whole or absent after each call, the second call must make the bytes of an undisturbed one, and
nothing else may be left beside it.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import yaml

from benchmarks.faults.laboratories import small_scenario
from benchmarks.faults.stages import Count

SIGNALS = {"kill at a moment": signal.SIGKILL, "SIGTERM": signal.SIGTERM, "Ctrl-C": signal.SIGINT}


def disturbed(room: Path, faults: list[str], times: int, rng: random.Random) -> dict[str, Count]:
    """Those of the faults that are signals, so many times each."""
    parent, scenario = room / "rendered", room / "scenario.yaml"
    parent.mkdir(parents=True)
    scenario.write_text(yaml.safe_dump(small_scenario()))
    begun = time.monotonic()
    _started(scenario, parent / "lab").wait()
    length, wanted = time.monotonic() - begun, _contents(parent / "lab")
    found = {}
    for name in faults:
        if name not in SIGNALS:
            continue
        hit, lost = 0, []
        for _ in range(times):
            shutil.rmtree(parent / "lab")
            running = _started(scenario, parent / "lab")
            time.sleep(rng.uniform(0.0, length))
            running.send_signal(SIGNALS[name])
            hit += running.wait() != 0
            if (parent / "lab").exists() and _contents(parent / "lab") != wanted:
                lost.append("an unfinished folder")
            if not (parent / "lab").exists() and _started(scenario, parent / "lab").wait():
                lost.append("the second call failed")
            elif _contents(parent / "lab") != wanted:
                lost.append("other bytes")
            if left := sorted(set(os.listdir(parent)) - {"lab"}):
                lost.append(f"left {left[0]}")
        found[name] = Count(times, hit, lost, 0)
    shutil.rmtree(parent)
    return found


def _started(scenario: Path, folder: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "vidtrack.simulate", str(scenario), str(folder), "--threads", "2"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
