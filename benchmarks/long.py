"""Long recordings: whether one uses all cores, and how much memory two hours of it need.

    PYTHONPATH=. python benchmarks/long.py cores [--frames 600] [--rounds 5] [--only h264_1080p mpeg2]
    PYTHONPATH=. python benchmarks/long.py memory [--hours 2] [--targets 3] [--whole] [--plot memory.png]

cores    The track stage on one recording, with as many threads as there are cores and with one, taking turns. Printed:
         the ratio of elapsed times; how large a share of all processor time the busiest thread has, which bounds what
         any number of cores could gain and does not depend on other work; and whether the tables and the record are the
         same to the last bit.
memory   The track job, as the workflow calls it, on a film of 320 x 240 that is written once for a minute and its
         packets repeated, each repeat beginning with a key frame; with --whole what follows it for the run too.
         Resident memory is read ten times a second: printed as a table, the peak of each job last; --plot draws it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.track import ALL_KEYS, CLIPS, Scene, encode, follow, repeat_packets, write_clip

RATE = Fraction(30000, 1001)
LIMIT_MB = 600
KINDS = CLIPS | ALL_KEYS


class Taken(NamedTuple):
    """What following one recording took: s; the busiest thread's share; a checksum of all that came out."""

    wall: float
    processor: float
    busiest: float
    answer: str


def taken(path: Path, n: int, threads: int) -> Taken:
    """In a process of its own, so that threads of another run are not counted."""
    command = [sys.executable, __file__, "one", "--path", str(path), "--targets", str(n), "--threads", str(threads)]
    answer = subprocess.run(command, check=True, capture_output=True, text=True)
    return Taken(*json.loads(answer.stdout))


def one(path: Path, n: int, threads: int) -> Taken:
    """Follow the targets; threads and processes that ended are counted by what they had used shortly before."""
    import pandas  # noqa: F401  its import is not part of it

    used: dict[int, float] = {}
    stopped = threading.Event()

    def look() -> None:
        while not stopped.wait(0.05):
            used.update(_by_thread())

    before = _by_thread()
    looker = threading.Thread(target=look)
    looker.start()
    wall, processor = time.perf_counter(), sum(os.times()[:4])
    tracked = follow(path, n, threads)
    wall, processor = time.perf_counter() - wall, sum(os.times()[:4]) - processor
    used.update(_by_thread())
    stopped.set()
    looker.join()
    spent = [seconds - before.get(thread, 0.0) for thread, seconds in used.items()]
    digest = hashlib.sha256()
    for table in (tracked.centroids, tracked.tracklets):
        digest.update(table.to_csv(index=False, float_format="%r").encode())
    digest.update(repr(sorted(tracked.diagnostics["targets"].items())).encode())
    return Taken(wall, processor, max(spent) / processor, digest.hexdigest()[:16])


def _by_thread() -> dict[int, float]:
    """Processor time of each thread of this process, and of each process that it has begun, s."""
    ticks, out = os.sysconf("SC_CLK_TCK"), {}
    places = [f"/proc/self/task/{thread}" for thread in os.listdir("/proc/self/task")]
    with open(f"/proc/self/task/{os.getpid()}/children") as file:
        places += [f"/proc/{child}" for child in file.read().split()]
    for place in places:
        try:
            with open(f"{place}/stat") as file:
                fields = file.read().rpartition(")")[2].split()
        except OSError:
            continue
        out[int(place.rpartition("/")[2])] = (int(fields[11]) + int(fields[12])) / ticks
    return out


def cores(frames: int, rounds: int, only: list[str], n: int, folder: Path) -> None:
    many = len(os.sched_getaffinity(0))
    print(f"{frames} frames, {n} targets, {rounds} rounds, {many} cores, load {os.getloadavg()[0]:.0f}")
    print(
        "| recording | elapsed, all cores over one | processor time, all over one | busiest thread | same to the bit |"
    )
    print("|---|---|---|---|---|")
    for kind in only or KINDS:
        path = folder / f"{kind}_{n}_{frames}.{KINDS[kind][1]}"
        if not path.exists():
            write_clip(path, kind, n, frames)
        pairs = [(taken(path, n, many), taken(path, n, 1)) for _ in range(rounds)]
        wall, processor = (statistics.median(a[i] / b[i] for a, b in pairs) for i in (0, 1))
        busiest = statistics.median(a.busiest for a, _ in pairs)
        same = len({part.answer for pair in pairs for part in pair}) == 1
        size = "x".join(map(str, KINDS[kind][2]))
        print(
            f"| {KINDS[kind][0]} {size} | {wall:.2f} | {processor:.2f} | {100 * busiest:.0f} %, with one "
            f"{100 * statistics.median(b.busiest for _, b in pairs):.0f} % | {'yes' if same else 'NO'} |",
            flush=True,
        )


def write_long(path: Path, hours: float, n: int) -> int:
    """A film whose packets are a minute's, again and again; how many frames."""
    minute, frames = path.with_name("minute.mp4"), round(60 * RATE)
    scene, size = Scene((320, 240), n), (320, 240)
    import numpy as np

    grains = np.random.default_rng(1).normal(0, 3, (8, 240, 320)).astype(np.float32)
    period = 45  # frames, after which each ball is where it was, but for its slower second motion: see Scene.at
    pictures = (scene.picture(k % (10 * period), grains[k % 8]) for k in range(frames - frames % (10 * period)))
    encode(minute, ("libx264", "mp4", size, "yuv420p", {"crf": "28", "preset": "ultrafast", "bf": "0"}), pictures)
    total = round(hours * 3600 * RATE)
    repeat_packets(minute, path, total)
    return total


def memory(hours: float, n: int, plot: str | None, whole: bool, folder: Path) -> None:
    """The jobs of one run by one camera in a plane: no calibration is needed to see what length costs."""
    path = folder / "long.mp4"
    frames = write_long(path, hours, n)
    print(f"{hours:g} h, {frames} frames, {n} targets, {path.stat().st_size / 1e6:.0f} MB", flush=True)
    lab = folder / "lab"
    (lab / "runs/long").mkdir(parents=True)
    os.link(path, lab / "runs/long/cam1.mp4")
    (lab / "config.yaml").write_text(
        "experiment: .\nunits: mm\ncameras: {cam1: {}}\n"
        f"runs: {{long: {{mode: plane, targets: {n}, plane: {{scale: 1.0}}}}}}\n"
    )
    begun, curve = time.monotonic(), []
    command = [sys.executable, "-m", "snakemake", "-s", str(Path(__file__).parents[1] / "Snakefile")]
    command += [
        "--profile",
        str(Path(__file__).parents[1] / "profiles/default"),
        "--directory",
        str(lab),
        "--cores",
        "2",
    ]
    command += [] if whole else ["results/runs/long/centroids/cam1.parquet"]
    with (folder / "said").open("w") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said)
        while process.poll() is None:
            curve += [(time.monotonic() - begun, rule, mb) for rule, mb in _resident(process.pid).items()]
            time.sleep(0.1)
    _print_curve(curve)
    if plot:
        _draw(curve, plot)
    if process.returncode:
        sys.exit((folder / "said").read_text())


def _resident(parent: int) -> dict[str, float]:
    """Resident memory, MB, of each job of the workflow: rule (15 letters at most): MB; shared pages count."""
    import psutil

    out: dict[str, float] = {}
    try:
        children = psutil.Process(parent).children(recursive=True)
    except psutil.Error:
        return out
    for child in children:
        try:
            words, name, resident = child.cmdline(), child.name(), child.memory_info().rss / 2**20
        except psutil.Error:
            continue
        if "vidtrack" in words[1:3] and words.index("vidtrack") + 1 < len(words):
            rule = words[words.index("vidtrack") + 1]
        elif "vidtrack.workflow.job_server" in words:
            rule = "job server" if name.startswith("python") else name  # workers have the name of their job
        else:
            continue
        out[rule] = max(out.get(rule, 0.0), resident)
    return out


def _print_curve(curve: list[tuple[float, str, float]]) -> None:
    track = [(t, mb) for t, rule, mb in curve if rule == "track"]
    print("| s of the track job | resident, MB |\n|---|---|")
    end = track[-1][0]
    for share in (0.02, 0.05, *(k / 10 for k in range(1, 11))):
        t, mb = min(track, key=lambda at: abs(at[0] - track[0][0] - share * (end - track[0][0])))
        print(f"| {t - track[0][0]:.0f} | {mb:.0f} |")
    print("| job | peak, MB |\n|---|---|")
    peaks: dict[str, float] = {}
    for _, rule, mb in curve:
        peaks[rule] = max(peaks.get(rule, 0.0), mb)
    for rule, mb in sorted(peaks.items(), key=lambda one: -one[1]):
        print(f"| {rule} | {mb:.0f} (limit {LIMIT_MB}){' ABOVE' if mb > LIMIT_MB else ''} |")


def _draw(curve: list[tuple[float, str, float]], path: str) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3.2), layout="constrained")
    axes = figure.add_subplot(xlabel="s", ylabel="resident memory, MB")
    for rule in dict.fromkeys(rule for _, rule, _ in curve):
        own = [(t, mb) for t, its, mb in curve if its == rule]
        axes.plot(*zip(*own, strict=True), ".", markersize=2, label=rule)
    axes.axhline(LIMIT_MB, color="0.5", linewidth=1)
    axes.legend(fontsize="small")
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("cores", "memory", "one"))
    parser.add_argument("--frames", type=int, default=600)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--targets", type=int, default=3)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--plot")
    parser.add_argument("--whole", action="store_true")
    parser.add_argument("--path", type=Path)
    parser.add_argument("--threads", type=int, default=1)
    asked: Any = parser.parse_args()
    if asked.what == "one":
        print(json.dumps(one(asked.path, asked.targets, asked.threads)))
        return
    with tempfile.TemporaryDirectory(prefix="long-") as folder:
        if asked.what == "cores":
            cores(asked.frames, asked.rounds, asked.only, asked.targets, Path(folder))
        else:
            memory(asked.hours, asked.targets, asked.plot, asked.whole, Path(folder))


if __name__ == "__main__":
    main()
