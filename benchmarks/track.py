"""How much slower than plain decoding the whole track stage is, and how well and how fast centroids are measured.

    python benchmarks/track.py stage [--frames 900] [--rounds 7] [--only mpeg2 dv]
    python benchmarks/track.py limits
    python benchmarks/track.py accuracy
    python benchmarks/track.py sd [--only dv h264]
    python benchmarks/track.py peers

`stage` renders clips of 10, 50 and 200 balls of radius 4 px with noise, writes them with each codec, and compares the
track stage with a PyAV loop that decodes the same file with the same threads and touches no pixel. The two take turns
in one process; ratios are of medians, of elapsed time (the stage measures beside the decoder) and of processor time,
which a busy computer changes less. The second look at pictures that change suddenly, which the reader does behind the
last one, is counted apart, and with both. What was tracked is compared with the scene afterwards. `sd` follows balls of
five sizes, at rest and moving, through codecs, and prints z, the rms of error over sd_x, sd_y, which is 1 for an honest
sd (errors beyond 1 px are counted as wrong). `limits` runs the track job as the workflow does, on 450, 900 and 2700
frames of 1080p (450 in a loop, and as many different ones, with B pictures, which takes two minutes to write), and
prints its peak memory and how long it takes from its start to the first frame.
`peers` needs trackpy, numba and scikit-image: this script runs in any Python that has them beside vidtrack's own
dependencies (a venv of its own keeps them out of the project's).
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from fractions import Fraction
from functools import partial
from itertools import product
from pathlib import Path

import av
import cv2
import numpy as np

from vidtrack.tracking.detection.blobs import find_blobs
from vidtrack.video.reader import open_video

CLIPS = {
    "mpeg2": ("mpeg2video", "mpg", (720, 480), "yuv420p", {"b": "6000000"}),
    "h264": ("libx264", "mp4", (720, 480), "yuv420p", {"crf": "20", "preset": "fast"}),
    "dv": ("dvvideo", "dv", (720, 480), "yuv411p", {}),
    "ffv1": ("ffv1", "mkv", (720, 480), "gray", {}),
    "mjpeg_1080p": ("mjpeg", "mov", (1920, 1080), "yuvj420p", {"qmin": "3", "qmax": "3"}),
    "h264_1080p": ("libx264", "mp4", (1920, 1080), "yuv420p", {"crf": "20", "preset": "veryfast"}),
}
ALL_KEYS = {
    "prores": ("prores_ks", "mov", (1920, 1080), "yuv422p10le", {"profile": "1"}),
    "dnxhd": ("dnxhd", "mov", (1920, 1080), "yuv422p", {"profile": "dnxhr_lb"}),
    "huffyuv": ("huffyuv", "avi", (1920, 1080), "yuv422p", {}),
    "ffv1_1080p": ("ffv1", "mkv", (1920, 1080), "gray", {}),
}
"""Further codecs of which each picture stands for itself: how many cores decode them is measured by long.py."""
LIMITS = {10: 1.15, 50: 1.3, 200: 1.5}
PEAK_MB, FIRST_FRAME_S = 400, 1.0
LENGTHS = (450, 900, 2700)
LOOP = 450
"""Frames after which each ball is where it began: see Scene.at."""
FIRST_FRAME = """
import sys, time
import vidtrack.jobs.track as job
with job.open_video(sys.argv[1]) as video:
    next(video.frames())
    print(time.time())
"""
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stderr=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


class Scene:
    """Balls on a grid, each circling its home; positions (n, 2) px at a time in frames."""

    def __init__(self, size: tuple[int, int], n: int, radius: float = 4.0) -> None:
        width, height = size
        columns = int(np.ceil(np.sqrt(n * width / height)))
        rows = int(np.ceil(n / columns))
        k = np.arange(n)
        self.pitch = min(width / columns, height / rows)
        self.home = np.stack([(k % columns + 0.5) * width / columns, (k // columns + 0.5) * height / rows], axis=1)
        self.phase = 2.399963 * k
        self.size, self.radius = size, radius
        self.swing = min(12.0, self.pitch / 2 - radius - 6)

    def at(self, t: float) -> np.ndarray:
        angle = 2 * np.pi * t / 45 + self.phase
        return self.home + self.swing * np.stack([np.cos(angle), np.sin(1.3 * angle)], axis=1)

    def picture(self, t: float, grain: np.ndarray, level: float = 30, contrast: float = 180) -> np.ndarray:
        image = np.full(self.size[::-1], level, np.float32) + grain
        reach = int(self.radius + 2)
        span = np.arange(-reach, reach + 1)
        for x, y in self.at(t):
            i, j = round(float(x)), round(float(y))
            off = np.hypot(span[None] - (x - i), span[:, None] - (y - j))
            image[j - reach : j + reach + 1, i - reach : i + reach + 1] += contrast * np.clip(
                self.radius + 0.5 - off, 0, 1
            )
        return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def write_clip(path: Path, kind: str, n: int, frames: int) -> None:
    clip = (CLIPS | ALL_KEYS)[kind]
    size = clip[2]
    scene, rng = Scene(size, n), np.random.default_rng(1)
    grains = rng.normal(0, 3, (8, *size[::-1])).astype(np.float32)

    def pictures():
        for k in range(frames):
            picture = scene.picture(k, grains[k % 8])
            if kind == "dv":  # bottom field first
                later = scene.picture(k + 0.5, grains[(k + 3) % 8])
                picture[0::2] = later[0::2]
            yield picture

    encode(path, clip, pictures())


def write_loop(path: Path, n: int, frames: int) -> None:
    """A film of 1080p whose packets are those of LOOP frames, again and again."""
    once = path.with_name(f"h264_1080p_{n}_loop.mp4")
    codec, ending, size, pix_fmt, options = CLIPS["h264_1080p"]
    if not once.exists():
        scene, rng = Scene(size, n), np.random.default_rng(1)
        grains = rng.normal(0, 3, (8, *size[::-1])).astype(np.float32)
        pictures = (scene.picture(k, grains[k % 8]) for k in range(LOOP))
        encode(once, (codec, ending, size, pix_fmt, {**options, "bf": "0"}), pictures)
    repeat_packets(once, path, frames)


def repeat_packets(once: Path, path: Path, frames: int) -> None:
    """A film of so many frames whose packets are those of another one, without B pictures, again and again."""
    with av.open(str(once)) as source, av.open(str(path), "w") as out:
        stream = source.streams.video[0]
        packets = [(p.pts, p.is_keyframe, bytes(p)) for p in source.demux(stream) if p.size]
        copy, step = out.add_stream_from_template(stream), packets[1][0] - packets[0][0]
        for k in range(frames):
            _, key, data = packets[k % len(packets)]
            packet = av.Packet(data)
            packet.pts = packet.dts = k * step
            packet.time_base, packet.stream, packet.is_keyframe = stream.time_base, copy, key
            out.mux(packet)


def encode(path: Path, clip: tuple, pictures) -> None:
    codec, _, size, pix_fmt, options = clip
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=Fraction(30000, 1001), options=options)
        stream.width, stream.height = size
        stream.pix_fmt = pix_fmt
        for k, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format=pix_fmt)
            if pix_fmt != "gray":  # reformatting would squeeze the levels: put the luma in as it is
                plane = np.frombuffer(frame.planes[0], np.uint8).reshape(size[1], -1)
                plane[:, : size[0]] = picture
            frame.pts = k
            frame.time_base = Fraction(1001, 30000)
            for packet in stream.encode(frame):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)


def decode(path: Path, threads: int) -> int:
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        stream.codec_context.thread_count = threads
        stream.codec_context.thread_type = "AUTO"
        return sum(1 for _ in container.decode(stream))


def follow(path: Path, n: int, threads: int):
    """What was tracked, and the elapsed time of the second look at pictures that change suddenly, s."""
    from vidtrack.stages.track import track
    from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures

    look = [0.0]

    def look_again(indices):
        began = time.perf_counter()
        found = video.look_again(indices)
        look[0] = time.perf_counter() - began
        return found

    with open_video(str(path), threads=threads) as video:
        damage = DamagedPictures(video.info.bits, look_again, video.info.codec)
        frames = damage.over(video.frames(apart=True, monitor=damage, targets=n))
        return track(frames, video.info, targets=n, damage=damage), look[0]


def against_scene(tracked, kind: str, n: int) -> dict:
    """rms and largest error px, samples in which another ball was nearer, and z.

    Each target is the ball that it was nearest to at first.
    """
    table = tracked.centroids
    scene = Scene(CLIPS[kind][2], n)
    late = (table["field"] == "top") / 2  # bottom field first
    truth = np.array([scene.at(t) for t in (table["frame"] + late).to_numpy()[::n]])
    place, sd = (table[columns].to_numpy().reshape(-1, n, 2) for columns in (["Xf", "Yf"], ["sd_x", "sd_y"]))
    seen = np.isfinite(place[..., 0])
    first = seen.argmax(axis=0)
    ball = np.hypot(*(truth[first] - place[first, np.arange(n)][:, None]).transpose(2, 0, 1)).argmin(axis=1)
    error = place - truth[:, ball]
    near = [np.hypot(*(p[:, None] - t).transpose(2, 0, 1)).argmin(axis=1) for p, t in zip(place, truth, strict=True)]
    return {
        "measured": tracked.diagnostics["measured"],
        "rms": float(np.sqrt(np.nanmean(error**2))),
        "worst": float(np.sqrt(np.nanmax((error**2).sum(axis=-1)))),
        "mistaken": int(((np.array(near) != ball) & seen).sum()) + n - np.unique(ball).size,
        "z": float(np.sqrt(np.nanmean((error / sd) ** 2))),
    }


def seconds(action, *arguments) -> tuple[tuple[float, float], object]:
    """Elapsed time, which holds on an idle computer alone, and processor time of all threads and processes, s."""
    began = time.perf_counter(), sum(os.times()[:4])
    result = action(*arguments)
    return (time.perf_counter() - began[0], sum(os.times()[:4]) - began[1]), result


def stage(frames: int, rounds: int, only: list[str], counts: list[int], threads: int, folder: Path) -> list[dict]:
    import pandas  # noqa: F401  its import is not part of either side

    table = []
    for kind in only or CLIPS:
        for n in counts:
            path = folder / f"{kind}_{n}_{frames}.{CLIPS[kind][1]}"
            if not path.exists():
                write_clip(path, kind, n, frames)
            plain, whole = [], []
            for _ in range(rounds):
                plain.append(seconds(decode, path, threads)[0])
                took, (tracked, look) = seconds(follow, path, n, threads)
                whole.append((*took, took[0] - look))
            (plain_s, plain_cpu), (all_s, whole_cpu, whole_s) = (np.median(times, axis=0) for times in (plain, whole))
            row = {
                "clip": kind,
                "targets": n,
                "decode_ms": 1e3 * plain_s / frames,
                "stage_ms": 1e3 * whole_s / frames,
                "ratio": whole_s / plain_s,
                "with_look": all_s / plain_s,
                "processor": whole_cpu / plain_cpu,
                "limit": LIMITS[n],
                **against_scene(tracked, kind, n),
            }
            table.append(row)
            print(
                "{clip:11s} {targets:4d} targets  decode {decode_ms:6.2f} ms  stage {stage_ms:6.2f} ms  "
                "ratio {ratio:5.2f} (limit {limit}), with the second look {with_look:5.2f}, "
                "of processor time {processor:5.2f}  "
                "measured {measured:.4f}  rms {rms:.4f} px  worst {worst:.2f} px  "
                "mistaken {mistaken}  z {z:.2f}".format(**row),
                flush=True,
            )
    return table


def limits(rounds: int, folder: Path) -> None:
    """Peak memory of the whole job, MB, and time from its start to the first frame, s."""
    for film, frames in product(("loop", "different"), LENGTHS):
        path = folder / f"h264_1080p_10_{'loop_' * (film == 'loop')}{frames}.mp4"
        if not path.exists():
            write_loop(path, 10, frames) if film == "loop" else write_clip(path, "h264_1080p", 10, frames)
        peaks, waits = [], []
        for _ in range(rounds):
            with tempfile.TemporaryDirectory() as out:
                peaks.append(_peak_mb(path, Path(out)))
            began = time.time()
            printed = subprocess.run(
                [sys.executable, "-c", FIRST_FRAME, path], check=True, capture_output=True, text=True
            )
            waits.append(float(printed.stdout) - began)
        print(
            f"1080p {film:9s} {frames:5d} frames  peak {max(peaks):4.0f} MB (limit {PEAK_MB})  "
            f"first frame after {statistics.median(waits):.2f} s (limit {FIRST_FRAME_S})",
            flush=True,
        )


def _peak_mb(path: Path, out: Path) -> float:
    settings = {"run": "clip", "camera": "cam1", "targets": 10, "detect": {}}
    (out / "order.json").write_text(json.dumps({"settings": settings, "inputs": {str(path): ""}}))
    outputs = {
        "centroids": "c.parquet",
        "tracklets": "t.parquet",
        "windows": "w.parquet",
        "record": "r.json",
        "light": "l.parquet",
        "background": "b.parquet",
    }
    outputs["picture"] = "b.png"
    command = [sys.executable, "-m", "vidtrack", "track", "--settings", str(out / "order.json")]
    command += ["--input", "video", str(path)]
    for name, file in outputs.items():
        command += ["--output", name, str(out / file)]
    # a process of its own in between: a child begins with the memory of its parent
    printed = subprocess.run([sys.executable, "-c", PEAK, *command], check=True, capture_output=True, text=True)
    return int(printed.stdout) / 1024


def accuracy(pictures: int) -> None:
    """Errors of every kernel on balls drawn by exact area at random places, px."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.discs import windows
    from vidtrack.tracking.centroiding.centroid import measure
    from vidtrack.tracking.centroiding.components import Windows, components
    from vidtrack.tracking.centroiding.template import Known, apply_template
    from vidtrack.tracking.detect_settings import Detection
    from vidtrack.tracking.sample import Sample

    print(f"contrast 200; rms and bias in X and Y, px, over {pictures} balls a line")
    for radius in (1.5, 2.5, 4.0, 6.0, 15.0):
        for noise in (3.0, 10.0):
            side = 2 * int(radius) + 26
            stack, truth = windows(pictures, radius, side=side, noise=noise)
            zero = np.zeros(pictures, np.intp)
            view = Windows(stack, zero, zero, 1.0)
            found = components(view, 130.0)
            middle = np.hypot(found.x - side / 2, found.y - side / 2)
            order = np.lexsort((middle, found.window))
            _, first = np.unique(found.window[order], return_index=True)
            results = {
                kind: measure(view, found, order[first], noise=noise, kind=kind, threshold=130.0)
                for kind in ("weighted", "ellipse", "binary")
            }
            row = np.ascontiguousarray(stack.reshape(side, pictures * side))
            looks = results["weighted"]
            size = np.stack([found.width[order[first]], found.height[order[first]]], axis=1).astype(float)
            known = Known(np.tile(size.mean(axis=0), (pictures, 1)), np.full(pictures, np.nanmean(looks.soft)),
                          np.full(pictures, noise), looks.pixels.astype(float), np.full(pictures, 130.0))  # fmt: skip
            offset = np.stack([np.arange(pictures) * side, zero], axis=1)
            seen = apply_template([Sample(row, 0.0)], (truth + offset)[None], known, Detection(noise=noise))
            places = {kind: np.stack([c.x, c.y], axis=1) for kind, c in results.items()}
            places["template"] = np.where(seen.clear[0, :, None], seen.values[:2, 0].T - offset, np.nan)
            for kind, place in places.items():
                error = place - truth
                rms, bias = np.sqrt(np.nanmean(error**2, axis=0)), np.nanmean(error, axis=0)
                print(
                    f"radius {radius:4.1f}  noise {noise:4.1f}  {kind:9s} rms {rms[0]:.4f} {rms[1]:.4f}  "
                    f"bias {bias[0]:+.4f} {bias[1]:+.4f}  measured {np.isfinite(error[:, 0]).mean():.3f}"
                )


SD_CLIPS = {
    "ffv1": CLIPS["ffv1"],
    "dv": CLIPS["dv"],
    "mpeg2_6": CLIPS["mpeg2"],
    "mpeg2_2": ("mpeg2video", "mpg", (720, 480), "yuv420p", {"b": "2000000"}),
    "h264_18": ("libx264", "mp4", (720, 480), "yuv420p", {"crf": "18", "preset": "fast"}),
    "h264_28": ("libx264", "mp4", (720, 480), "yuv420p", {"crf": "28", "preset": "fast"}),
}
SD_RADII = (1.5, 2.5, 4.0, 6.0, 15.0)


def honest_sd(only: list[str], folder: Path, frames: int = 96) -> None:
    """z of targets at rest and moving, by radius."""
    from pandas import DataFrame

    from vidtrack.stages.track import track

    rng, n = np.random.default_rng(5), 60
    cell, radius = rng.permutation(n), np.repeat(SD_RADII, 12)
    home = np.stack([(cell % 10 + 0.5) * 72, (cell // 10 + 0.5) * 80], axis=1) + rng.uniform(-2, 2, (n, 2))
    moving = np.arange(n) % 2 == 1
    angle = 2 * np.pi * np.arange(frames)[:, None] / 45 + rng.uniform(0, 2 * np.pi, n)
    truth = home + 12 * moving[:, None] * np.stack([np.cos(angle), np.sin(1.3 * angle)], axis=-1)
    boxes = DataFrame({"target": [f"t{i}" for i in range(n)], "Xf": truth[0, :, 0], "Yf": truth[0, :, 1]})
    for kind in only or SD_CLIPS:
        for contrast in (60, 200):
            for noise in (1, 3, 10):
                path = folder / f"sd_{kind}_{contrast}_{noise}.{SD_CLIPS[kind][1]}"
                if not path.exists():
                    encode(path, SD_CLIPS[kind], _exact_pictures(truth, radius, contrast, noise))
                with open_video(str(path)) as video:
                    info = video.info
                    table = track(video.frames(), info, targets=n, start_boxes=boxes, fields="frame").centroids
                place, sd = (table[c].to_numpy().reshape(-1, n, 2) for c in (["Xf", "Yf"], ["sd_x", "sd_y"]))
                error = place - truth
                wrong = (error**2).sum(axis=-1) > 1
                error[wrong] = np.nan
                line = f"{kind:8s} contrast {contrast:3d}  noise {noise:2d}"
                for word, some in (("at rest", ~moving), ("moving", moving)):
                    line += f"  {word}" + "".join(_z(error, sd, some & (radius == r)) for r in SD_RADII)
                print(f"{line}  measured {np.isfinite(error[..., 0]).mean():.3f}  wrong {wrong.sum()}", flush=True)


def _z(error: np.ndarray, sd: np.ndarray, who: np.ndarray) -> str:
    z = error[:, who] / sd[:, who]
    return f" {np.sqrt(np.nanmean(z**2)):5.2f}" if np.isfinite(z).sum() > 60 else "     -"


def _exact_pictures(truth: np.ndarray, radius: np.ndarray, contrast: float, noise: float):
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.discs import picture

    rng = np.random.default_rng(3)
    for places in truth:
        balls = np.column_stack([places, radius])
        yield picture((480, 720), balls, contrast=contrast, noise=noise, rng=rng)


def peers(rounds: int) -> None:
    """Centroid time alone on the same pictures, taking turns; errors over the same balls."""
    from vidtrack.tracking.centroiding.template import Known, apply_template
    from vidtrack.tracking.centroiding.window import segment_windows
    from vidtrack.tracking.detect_settings import Detection
    from vidtrack.tracking.sample import Sample

    for size in ((720, 480), (1920, 1080)):
        for n in (1, 10, 50):
            scene, rng = Scene(size, n), np.random.default_rng(0)
            grain = rng.normal(0, 4, size[::-1]).astype(np.float32)
            times = range(8)
            pictures = [scene.picture(t, grain) for t in times]
            truth = np.array([scene.at(t) for t in times])
            expected = truth + rng.normal(0, 1, truth.shape)
            samples = [Sample(p, float(t)) for t, p in zip(times, pictures, strict=True)]
            wide, level = np.full((n, 2), 8.0), np.full(n, 120.0)
            known = Known(wide, np.full(n, 1.7), np.full(n, 4.0), np.full(n, 50.0), level)
            detection = Detection(noise=4.0)
            settings = {"size": wide, "pixels": np.full(n, 50.0), "threshold": level, "detection": detection}
            methods: dict[str, partial] = {
                "vidtrack, template, as the stage does": partial(apply_template, samples, expected, known, detection),
                "vidtrack, segmented windows": partial(segment_windows, samples, expected, **settings),
                "vidtrack, whole picture": partial(_each, partial(find_blobs, threshold=120, noise=4.0), pictures),
                "cv2.SimpleBlobDetector": partial(_each, _simple, pictures),
                "skimage regionprops": partial(_each, _regions, pictures),
                "trackpy.locate (numba)": partial(_each, _trackpy, pictures),
            }
            took: dict[str, list[float]] = {name: [] for name in methods}
            result = {}
            for _ in range(rounds + 1):
                for name, method in methods.items():
                    seconds_, result[name] = seconds(method)
                    took[name].append(seconds_)
            mine = statistics.median(took["vidtrack, template, as the stage does"][1:])
            for name, found in result.items():
                middle = statistics.median(took[name][1:])
                error = _errors(found, truth)
                print(f"{size[0]}x{size[1]} {n:3d} targets  {name:42s} {1e3 * middle / len(times):8.3f} ms/frame  "
                      f"{middle / mine:7.1f} x  rms {error:.4f} px", flush=True)  # fmt: skip


def _each(action, pictures) -> list:
    return [action(picture) for picture in pictures]


def _errors(found, truth: np.ndarray) -> float:
    places = [found.values[:2, k].T for k in range(len(truth))] if isinstance(found, tuple) else found
    errors = []
    for place, true in zip(places, truth, strict=True):
        xy = np.stack([place.Xf, place.Yf], axis=1) if hasattr(place, "Xf") else np.asarray(place)
        near = np.hypot(*(xy[None] - true[:, None]).transpose(2, 0, 1)).argmin(axis=1)
        errors.append(xy[near] - true)
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _simple(picture: np.ndarray) -> np.ndarray:
    settings = cv2.SimpleBlobDetector_Params()
    settings.filterByColor, settings.blobColor = True, 255
    settings.filterByArea, settings.minArea, settings.maxArea = True, 10, 1000
    settings.filterByInertia = settings.filterByConvexity = settings.filterByCircularity = False
    settings.minThreshold, settings.maxThreshold, settings.thresholdStep = 80, 180, 50
    settings.minRepeatability = 1
    return np.array([point.pt for point in cv2.SimpleBlobDetector_create(settings).detect(picture)])


def _regions(picture: np.ndarray) -> np.ndarray:
    from skimage.measure import label, regionprops

    light = picture.astype(np.float32) - 30
    regions = regionprops(label(picture > 70), intensity_image=light)
    return np.array([region.centroid_weighted[::-1] for region in regions if region.area >= 10])


def _trackpy(picture: np.ndarray) -> np.ndarray:
    import trackpy

    return trackpy.locate(picture, 11, minmass=2000, engine="numba")[["x", "y"]].to_numpy()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["stage", "limits", "accuracy", "sd", "peers"])
    parser.add_argument("--frames", type=int, default=900)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--counts", nargs="*", type=int, default=[10, 50, 200])
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "vidtrack_bench")
    options = parser.parse_args()
    options.folder.mkdir(exist_ok=True)
    cv2.setNumThreads(1)
    if options.what == "stage":
        stage(options.frames, options.rounds, options.only, options.counts, options.threads, options.folder)
    elif options.what == "limits":
        limits(min(options.rounds, 3), options.folder)
    elif options.what == "accuracy":
        accuracy(3000)
    elif options.what == "sd":
        honest_sd(options.only, options.folder)
    else:
        peers(options.rounds)


if __name__ == "__main__":
    main()
