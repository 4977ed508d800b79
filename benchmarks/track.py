"""How much slower than plain decoding the whole track stage is, and how well and how fast centroids are measured.

    python benchmarks/track.py stage [--frames 300] [--rounds 5] [--only mpeg2 dv]
    python benchmarks/track.py accuracy
    python benchmarks/track.py peers [--peers-python /tmp/peers/bin/python]

`stage` renders clips of 10, 50 and 200 balls of radius 4 px with noise, writes them with each codec, and compares
the track stage with a PyAV loop that decodes the same file with the same threads and touches no pixel. The two
take turns in one process; ratios are of medians. `peers` needs trackpy, numba and scikit-image: this script runs in
any Python that has them beside vidtrack's own dependencies (a venv of its own keeps them out of the project's).
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from vidtrack.files.video import open_video

CLIPS = {
    "mpeg2": ("mpeg2video", "mpg", (720, 480), "yuv420p", {"b": "6000000"}),
    "h264": ("libx264", "mp4", (720, 480), "yuv420p", {"crf": "20", "preset": "fast"}),
    "dv": ("dvvideo", "dv", (720, 480), "yuv411p", {}),
    "ffv1": ("ffv1", "mkv", (720, 480), "gray", {}),
    "h264_1080p": ("libx264", "mp4", (1920, 1080), "yuv420p", {"crf": "20", "preset": "veryfast"}),
}
LIMITS = {10: 1.15, 50: 1.3, 200: 1.5}


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
    codec, _, size, pix_fmt, options = CLIPS[kind]
    scene, rng = Scene(size, n), np.random.default_rng(1)
    grains = rng.normal(0, 3, (8, *size[::-1])).astype(np.float32)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=Fraction(30000, 1001), options=options)
        stream.width, stream.height = size
        stream.pix_fmt = pix_fmt
        for k in range(frames):
            picture = scene.picture(k, grains[k % 8])
            if kind == "dv":  # bottom field first
                later = scene.picture(k + 0.5, grains[(k + 3) % 8])
                picture[0::2] = later[0::2]
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format=pix_fmt)
            if kind != "ffv1":  # reformatting would squeeze the levels: put the luma in as it is
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


def follow(path: Path, n: int, threads: int) -> float:
    from vidtrack.stages.track import track

    with open_video(str(path), threads=threads) as video:
        return track(video.frames(), video.info, targets=n).diagnostics["measured"]


def seconds(action, *arguments) -> tuple[float, object]:
    began = time.perf_counter()
    result = action(*arguments)
    return time.perf_counter() - began, result


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
                took, measured = seconds(follow, path, n, threads)
                whole.append(took)
            ratio = statistics.median(whole) / statistics.median(plain)
            row = {
                "clip": kind,
                "targets": n,
                "decode_ms": 1e3 * statistics.median(plain) / frames,
                "stage_ms": 1e3 * statistics.median(whole) / frames,
                "ratio": ratio,
                "limit": LIMITS[n],
                "measured": measured,
            }
            table.append(row)
            print(
                "{clip:11s} {targets:4d} targets  decode {decode_ms:6.2f} ms  stage {stage_ms:6.2f} ms  "
                "ratio {ratio:5.2f} (limit {limit})  measured {measured:.4f}".format(**row),
                flush=True,
            )
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["stage", "accuracy", "peers"])
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--counts", nargs="*", type=int, default=[10, 50, 200])
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "vidtrack_bench")
    options = parser.parse_args()
    options.folder.mkdir(exist_ok=True)
    cv2.setNumThreads(1)
    if options.what == "stage":
        stage(options.frames, options.rounds, options.only, options.counts, options.threads, options.folder)


if __name__ == "__main__":
    main()
