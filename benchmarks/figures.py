"""What `python -m benchmarks` measures: each a function of ours and one of a peer, or of the physical limit.

Times are processor time of the process and its children, ms: other work on the computer changes them less than elapsed
time. The functions are those of the other benchmarks, on smaller cases.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import yaml

from benchmarks import calibration, locate, reading, season
from benchmarks import track as tracking
from benchmarks.table import Figure, figure

HOUSE = Path(__file__).resolve().parent.parent
Action = Callable[[], object]
GROUPS = ("read", "track", "centroids", "association", "location", "calibration", "start", "planning", "whole")
"""The first words of rows."""


class Pair(NamedTuple):
    """A row to be: its name and its peer's, what is timed, and how many pieces of work each does."""

    name: str
    peer: str
    ours: Action
    theirs: Action
    pieces: tuple[int, int] = (1, 1)


def measured(pair: Pair, rounds: int) -> Figure:
    """Take turns; the first round warms up and does not count, where there are several."""
    took = []
    for _ in range(rounds + 1 if rounds > 1 else 1):
        took.append((_clocked(pair.ours) / pair.pieces[0], _clocked(pair.theirs) / pair.pieces[1]))
    return figure(pair.name, pair.peer, took[1:] or took)


def _clocked(action: Action) -> float:
    before = _used()
    action()
    return 1e3 * (_used() - before)


def _used() -> float:
    """Processor time of this process and of those that it has started and that ended, s; to microseconds."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def decoding(folder: Path, *, frames: int) -> Iterator[Pair]:
    """The reader over the decode limit."""
    for name, codec, pixel_format, options in (reading.CLIPS[0], reading.CLIPS[3]):
        path = folder / name
        reading.make(path, codec, pixel_format, options, (720, 480), frames)
        yield Pair(
            f"read, {codec} 720x480, a frame",
            "bare decode loop",
            lambda path=path: reading.reader(str(path), 1),
            lambda path=path: reading.bare(str(path), 1),
            (frames, frames),
        )


def track(folder: Path, *, frames: int) -> Iterator[Pair]:
    """The whole track stage over the decode limit."""
    for kind, n in (("h264", 10), ("h264", 50), ("mpeg2", 10)):
        path = folder / f"{kind}_{n}.{tracking.CLIPS[kind][1]}"
        tracking.write_clip(path, kind, n, frames)
        yield Pair(
            f"track, {kind} 720x480, {n} targets, a frame",
            "bare decode loop",
            lambda path=path, n=n: tracking.follow(path, n, 1),
            lambda path=path: tracking.decode(path, 1),
            (frames, frames),
        )


def centroids() -> Iterator[Pair]:
    """The kernel that measures most samples, beside those of other programs, on the same pictures."""
    from vidtrack.tracking.centroiding.template import Known, apply_template
    from vidtrack.tracking.detect_settings import Detection
    from vidtrack.tracking.sample import Sample

    n, size = 10, (1920, 1080)
    scene, rng = tracking.Scene(size, n), np.random.default_rng(0)
    grain = rng.normal(0, 4, size[::-1]).astype(np.float32)
    pictures = [scene.picture(t, grain) for t in range(4)]
    expected = np.array([scene.at(t) for t in range(4)]) + rng.normal(0, 1, (4, n, 2))
    samples = [Sample(p, float(t)) for t, p in enumerate(pictures)]
    known = Known(np.full((n, 2), 8.0), np.full(n, 1.7), np.full(n, 4.0), np.full(n, 50.0), np.full(n, 120.0))
    detection = Detection(noise=4.0)

    def ours() -> None:
        for _ in range(25):
            apply_template(samples, expected, known, detection)

    peers = {"cv2.SimpleBlobDetector": tracking._simple}
    with suppress(ImportError):
        import skimage.measure  # noqa: F401

        peers["skimage regionprops"] = tracking._regions
    with suppress(ImportError):
        import trackpy

        peers["trackpy.locate"] = lambda p: trackpy.locate(p, 11, minmass=2000, engine="python")
    for name, one in peers.items():
        quick = one is tracking._simple

        def theirs(one=one, quick=quick) -> None:
            for picture in pictures if quick else pictures[:1]:
                one(picture)

        yield Pair("centroids, 1080p, 10 targets, a picture", name, ours, theirs, (100, 4 if quick else 1))


def association() -> Iterator[Pair]:
    """Tracklets of several cameras to trajectories, beside matching frame by frame and linking."""
    sys.path.insert(0, str(HOUSE / "benchmarks"))
    import gauntlet
    from gauntlet_scenes import scene

    own = scene("wanderers", 30)
    ours = lambda: [gauntlet.by_association(own) for _ in range(3)]  # noqa: E731
    with suppress(ImportError):
        import trackpy  # noqa: F401
        from gauntlet_peers import by_peers

        theirs = lambda: by_peers(own, "trackpy")  # noqa: E731
        yield Pair("association, 5 to 15 targets, a scene", "epipolar match + trackpy", ours, theirs, (3, 1))
    from vidtrack.geometry.triangulate import locate_points

    b, sd = gauntlet.put_together(own.views, gauntlet.by_association(own))
    cameras = [v.camera for v in own.views]
    yield Pair(
        "association, 5 to 15 targets, a scene",
        "locating what it gives",
        ours,
        lambda: [locate_points(cameras, b, sd=sd, reject=3.0) for _ in range(3)],
        (3, 3),
    )


def location(*, points: int) -> Iterator[Pair]:
    """Points located from two cameras with undistortion and covariance."""
    rng = np.random.default_rng(0)
    p = locate.places(points, rng)
    noise = rng.normal(0, locate.NOISE, (4, points, 2))
    ours = locate.ours(p, 2, noise)[0][1]
    for name, theirs in [*locate.opencv(p, 2, noise), *locate.openptv(p, 2, noise), *locate.anipose(p, 2, noise, 500)]:
        yield Pair(f"location, 2 cameras, {points} points", name, ours, theirs)


def calibrating() -> Iterator[Pair]:
    """One camera with bad points found, starts compared, centre searched and covariance, beside one fit of OpenCV."""
    rng = np.random.default_rng(0)
    p = locate.thesis_points()[1]
    tables = [
        calibration.sightings(c, 0.1, p + rng.uniform(-1, 1, p.shape) / 32, rng) for c in calibration.thesis_rig(2)
    ]
    for model in ("full", "auto"):
        settings = {} if model == "full" else {"model": "auto"}

        def ours(settings=settings) -> None:
            for table in tables:
                calibration.calibrate(table, **calibration.RIG, **settings)

        def theirs() -> None:
            for table in tables:
                calibration.by_opencv(table, calibration.RIG["image_size"], 800.0, calibration.RICH)

        yield Pair(f"calibration, 2 cameras, 64 points, {model}", "cv2.calibrateCamera, all terms", ours, theirs)


def start_up() -> Iterator[Pair]:
    """What the command, and a job that no server forks, cost before they begin."""

    def python(code: str) -> Action:
        environment = os.environ | {"PYTHONPATH": str(HOUSE)}
        return lambda: subprocess.run([sys.executable, "-c", code], env=environment, check=True)

    yield Pair("start of the command", "python -c pass", python("import vidtrack.command"), python("pass"))
    libraries = "import numpy, pandas, pyarrow.parquet, scipy.optimize"
    yield Pair("start of job kinematics", libraries, python("import vidtrack.jobs.kinematics"), python(libraries))
    seen = "import av, cv2, numpy, pandas, pyarrow.parquet"
    yield Pair("start of job track", seen, python("import vidtrack.jobs.track"), python(seen))


def planning(folder: Path, *, runs: int) -> Iterator[Pair]:
    """`snakemake -n` with nothing to do, beside a workflow of as many jobs that copy a file."""
    lab, bare = folder / "season", folder / "bare"
    jobs = season.pretended_season(lab, runs, HOUSE)
    bare.mkdir()
    (bare / "Snakefile").write_text(
        f"rule all:\n    input: expand('made/{{n}}', n=range({jobs}))\n\n"
        "rule one:\n    input: 'raw'\n    output: 'made/{n}'\n    shell: 'cp {input} {output}'\n"
    )
    (bare / "raw").write_text("raw")
    command = [sys.executable, "-m", "snakemake", "--directory", str(bare), "-s", str(bare / "Snakefile")]
    (bare / "made").mkdir()
    for n in range(jobs):
        (bare / f"made/{n}").write_text("raw")
    subprocess.run([*command, "--cores", "1", "--touch", "--forceall"], capture_output=True, check=True)
    environment = os.environ | {"PYTHONPATH": str(HOUSE)}

    def ours() -> None:
        subprocess.run(season.snakemake_command(lab, HOUSE, "-n"), env=environment, capture_output=True, check=True)

    def theirs() -> None:
        subprocess.run([*command, "-n"], capture_output=True, check=True)

    yield Pair(f"planning, {runs} runs, nothing to do", f"Snakemake, {jobs} jobs that copy a file", ours, theirs)


def whole(folder: Path) -> Iterator[Pair]:
    """An experiment of one short run, from recordings to report, beside decoding its recordings."""
    from vidtrack.simulate.laboratory import set_up
    from vidtrack.simulate.scenario import scenario_from

    lab = folder / "whole"
    set_up(scenario_from(yaml.safe_load((HOUSE / ".test/small.yaml").read_text()), "scenario"), str(lab), threads=1)
    environment = os.environ | {"PYTHONPATH": str(HOUSE), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

    def ours() -> None:
        command = season.snakemake_command(lab, HOUSE, "--forceall")
        subprocess.run(command, env=environment, capture_output=True, check=True)

    def theirs() -> None:
        for path in sorted(lab.rglob("*.mov")):
            reading.bare(str(path), 1)

    yield Pair("whole experiment, 1 run of 1.5 s, 3 clips", "bare decode of its recordings", ours, theirs)


def everything(folder: Path, *, quick: bool, only: Sequence[str] = ()) -> Iterator[tuple[Pair, int]]:
    """Each pair, and how many rounds are enough; only: of these groups."""
    cv2.setNumThreads(1)
    few, many = (3, 5) if quick else (5, 11)
    groups: dict[str, tuple[Callable[[], Iterator[Pair]], int]] = {
        "read": (partial(decoding, folder, frames=60 if quick else 120), many),
        "track": (partial(track, folder, frames=120 if quick else 450), few),
        "centroids": (centroids, many),
        "association": (association, few),
        "location": (partial(location, points=20_000 if quick else 100_000), many),
        "calibration": (calibrating, few),
        "start": (start_up, many),
        "planning": (partial(planning, folder, runs=10 if quick else 100), few),
        "whole": (partial(whole, folder), 1 if quick else 3),
    }
    for name, (pairs, rounds) in groups.items():
        if not only or name in only:
            for pair in pairs():
                yield pair, rounds
