"""The reader against a bare PyAV decode loop that touches no pixels: same files, same threads, interleaved.

    python benchmarks/reading.py [--frames 120] [--rounds 7] [--threads 1] [--sizes 720x480 1920x1080] [files ...]

Prints one line a clip: milliseconds a frame of each (medians) and the median of the ratios of neighbouring runs.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from vidtrack.video.reader import open_video

RATE = Fraction(30000, 1001)
CLIPS = (
    ("h264.mp4", "libx264", "yuv420p", {"crf": "20", "preset": "fast"}),
    ("mpeg2.mpg", "mpeg2video", "yuv420p", {"b": "8M"}),
    ("tape.dv", "dvvideo", "yuv411p", {}),
    ("ffv1.mkv", "ffv1", "gray", {"level": "3"}),
    ("mjpeg.avi", "mjpeg", "yuvj420p", {"q": "5"}),
    ("prores.mov", "prores_ks", "yuv422p10le", {}),
)


def scene(width: int, height: int, n: int, targets: int = 10) -> Iterator[np.ndarray]:
    """Grey pictures of moving balls in camera noise of 3 levels."""
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 3, (8, height, width)).astype(np.float32)
    y, x = np.mgrid[:height, :width].astype(np.float32)
    home = rng.uniform(0.1, 0.9, (targets, 2)) * (width, height)
    for i in range(n):
        picture = 40 + noise[i % 8]
        for cx, cy in home + 20 * np.sin(i / 9 + home):
            r = 12
            rows = slice(max(0, int(cy) - r), int(cy) + r)
            columns = slice(max(0, int(cx) - r), int(cx) + r)
            picture[rows, columns] += 170 * np.exp(-((x - cx)[rows, columns] ** 2 + (y - cy)[rows, columns] ** 2) / 20)
        yield np.clip(picture, 16, 235).astype(np.uint8)


def make(path: Path, codec: str, pixel_format: str, options: dict[str, str], size: tuple[int, int], n: int) -> None:
    """Encode the scene."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=RATE)
        stream.width, stream.height = size
        stream.pix_fmt, stream.options = pixel_format, options
        for i, grey in enumerate(scene(*size, n)):
            frame = av.VideoFrame.from_ndarray(grey, "gray").reformat(
                format=pixel_format, src_color_range=2, dst_color_range=2
            )
            frame.pts, frame.time_base = i, 1 / RATE
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def bare(path: str, threads: int) -> int:
    """Decode and do nothing else."""
    n = 0
    with av.open(path) as container:
        stream = container.streams.video[0]
        stream.codec_context.thread_count = threads
        stream.codec_context.thread_type = "AUTO"
        for packet in container.demux(stream):
            for _ in packet.decode():
                n += 1
    return n


def reader(path: str, threads: int) -> int:
    """Read every frame as the stages do."""
    n = 0
    with open_video(path, threads) as video:
        for _ in video.frames():
            n += 1
    return n


def clocked(read: Callable[[str, int], int], path: str, threads: int) -> tuple[float, float]:
    """Wall and processor milliseconds a frame."""
    wall, processor = time.perf_counter(), time.process_time()
    n = read(path, threads)
    return (time.perf_counter() - wall) / n * 1e3, (time.process_time() - processor) / n * 1e3


def first_frame(path: str) -> float:
    """Seconds from opening to the first frame, in a process that has imported everything."""
    start = time.perf_counter()
    with open_video(path) as video:
        next(iter(video.frames()))
        return time.perf_counter() - start


def compare(path: str, threads: int, rounds: int) -> None:
    """One line of the table."""
    runs = [(*clocked(bare, path, threads), *clocked(reader, path, threads)) for _ in range(rounds)]
    decode, processor, ours, ours_processor = (statistics.median(column) for column in zip(*runs, strict=True))
    ratio = statistics.median(run[2] / run[0] for run in runs)
    of_processor = statistics.median(run[3] / run[1] for run in runs)
    print(
        f"{Path(path).name:14} decode {decode:7.3f} ms  reader {ours:7.3f} ms  ratio {ratio:5.3f}  "
        f"processor {processor:7.3f} {ours_processor:7.3f} ratio {of_processor:5.3f}  "
        f"first frame {first_frame(path):.3f} s"
    )


def main() -> None:
    """Make the clips, or take those named, and compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*")
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--sizes", nargs="+", default=["720x480"])
    asked = parser.parse_args()
    for path in asked.files:
        compare(path, asked.threads, asked.rounds)
    if asked.files:
        return
    with tempfile.TemporaryDirectory() as folder:
        for size in asked.sizes:
            width, height = map(int, size.split("x"))
            print(f"{size}, {asked.frames} frames, {asked.threads} thread(s), {asked.rounds} rounds")
            for name, codec, pixel_format, options in CLIPS:
                if codec == "dvvideo" and (width, height) != (720, 480):
                    continue
                path = Path(folder) / name
                make(path, codec, pixel_format, options, (width, height), asked.frames)
                compare(str(path), asked.threads, asked.rounds)


if __name__ == "__main__":
    main()
