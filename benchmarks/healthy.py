"""Healthy recordings, in which no picture may be taken for damaged.

    python benchmarks/healthy.py --count 150 --seed 1            films of random encoders and settings
    python benchmarks/healthy.py --count 150 --seed 1 --every 20    20 pictures of each looked at a second time
    python benchmarks/healthy.py --count 150 --seed 1 --uncoded  the pictures themselves, as if each stood for itself
    python benchmarks/healthy.py --files A.mp4 B.mkv             these recordings

A film has 40 to 90 pictures of random scenes (texture, bare walls, black bars, balls, noise, cuts, flashes, fades,
flicker, shakes, pictures that repeat) and is coded by ffmpeg's command with random settings. An alarm is a picture that
is flagged by the decoder's word, by what the background shows, or by the second look at what changes suddenly. Without
--every that is looked at which a run looks at. A film is made again by its number: --seed 17 --count 1.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import av
import numpy as np

from vidtrack.timing.frame import Frame
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.video.faults.second_look import SecondLook
from vidtrack.video.reader import open_video

SIZES = ((320, 240), (320, 240), (320, 240), (322, 242), (176, 144), (640, 360))


def _background(rng: np.random.Generator, width: int, height: int) -> np.ndarray:
    Y, X = np.mgrid[:height, :width].astype(np.float32)
    level, kind = rng.uniform(40, 180), rng.integers(7)
    still = np.full((height, width), level, np.float32)
    if kind == 0:  # a bare wall, lit alike
        return still
    if kind == 1:  # or from one side
        return still + rng.uniform(-40, 40) * X / width + rng.uniform(-40, 40) * Y / height
    still += rng.uniform(5, 30) * np.sin(X / rng.uniform(3, 20)) * np.cos(Y / rng.uniform(3, 20))
    if kind in (2, 3):
        still += rng.normal(0, rng.uniform(2, 12), (height, width))
    if kind == 4:  # bars above and below
        bar = int(height * rng.uniform(0.05, 0.3))
        still[:bar] = still[-bar:] = 16
    if kind == 5:  # bars at the sides
        bar = int(width * rng.uniform(0.05, 0.3))
        still[:, :bar] = still[:, -bar:] = 16
    if kind == 6:  # a dark floor
        still[int(height * rng.uniform(0.3, 0.8)) :] = rng.uniform(16, 60)
    return still


def film(rng: np.random.Generator, size: tuple[int, int]) -> Iterator[np.ndarray]:
    """Pictures of a random scene, uint8."""
    width, height = size
    n = int(rng.integers(40, 91))
    Y, X = np.mgrid[:height, :width].astype(np.float32)
    still, noise = _background(rng, width, height), float(rng.choice([0, 0, 0.5, 1, 2, 4]))
    balls = [
        (*rng.uniform(0.1, 0.9, 2), rng.uniform(3, 14), rng.uniform(-120, 120), rng.uniform(0, 4), rng.uniform(4, 30))
        for _ in range(rng.integers(0, 5))
    ]
    gains = np.ones(n, np.float32)
    cuts, moved = set[int](), np.zeros((n, 2))
    repeats = rng.random(n) < float(rng.choice([0, 0, 0, 0.1, 0.5]))
    crossing: tuple[int, float] | None = None
    for event in rng.choice(10, rng.integers(0, 4), replace=False):
        at = int(rng.integers(2, n - 4))
        if event == 0:
            cuts = {int(i) for i in rng.integers(1, n, rng.integers(1, 4))}
        elif event == 1:  # a flash
            gains[at : at + rng.integers(1, 4)] *= rng.uniform(1.5, 6)
        elif event == 2:  # a lamp
            gains[at:] *= rng.uniform(0.4, 2.5)
        elif event == 3:  # fades
            end = min(n, at + int(rng.integers(5, 30)))
            gains[at:end] *= np.linspace(1, rng.uniform(0, 0.3), end - at)
            gains[end:] *= gains[end - 1]
        elif event == 4:  # flicker
            gains *= 1 + rng.uniform(0.02, 0.5) * np.sin(np.arange(n) * rng.uniform(0.5, 3))
        elif event == 5:  # shakes
            moved = rng.normal(0, rng.uniform(0.3, 6), (n, 2))
        elif event == 6:  # a knock
            moved[at:] += rng.normal(0, 8, 2)
        elif event == 7:  # a hand before the lens
            gains[at : at + rng.integers(1, 10)] = 0
        elif event == 8:  # something large that crosses
            crossing = at, float(rng.uniform(10, 80))
        elif event == 9:  # a pan
            moved += np.arange(n)[:, None] * rng.uniform(-3, 3, 2)
    levels = still
    grain = [rng.normal(0, noise, still.shape).astype(np.float32) if noise else still * 0 for _ in range(4)]
    for i in range(n):
        if i in cuts:
            still = _background(rng, width, height)
        if i and repeats[i]:
            yield levels
            continue
        dx, dy = moved[i]
        picture = np.roll(still, (round(dy), round(dx)), (0, 1))
        for x0, y0, radius, contrast, speed, swing in balls:
            x, y = (x0 * width + speed * i + dx) % width, y0 * height + swing * np.sin(i / 7 + x0) + dy
            rows, columns = (slice(max(0, int(at - radius - 8)), int(at + radius + 9)) for at in (y, x))
            away = np.hypot(X[rows, columns] - x, Y[rows, columns] - y) - radius
            picture[rows, columns] += contrast / (1 + np.exp(np.clip(1.2 * away, -50, 50)))
        if crossing is not None and 0 <= i - crossing[0] < width / crossing[1]:
            left = int((i - crossing[0]) * crossing[1])
            picture[:, left : left + width // 3] = 90 + 20 * np.sin(Y[:, left : left + width // 3] / 5)
        picture = picture * gains[i] + np.roll(grain[i % 4], tuple(rng.integers(0, 99, 2)), (0, 1))
        levels = np.clip(np.rint(picture), 16, 235).astype(np.uint8)
        yield levels


class Made(NamedTuple):
    """How a film is coded."""

    codec: str
    options: list[str]
    pix_fmt: str
    suffix: str


def _one(rng: np.random.Generator, *choices: Any) -> Any:
    return choices[int(rng.integers(len(choices)))]


def _any(rng: np.random.Generator, *choices: str, often: int = 2) -> list[str]:
    """The words of one of them, or, `often` times as often as one of them, none."""
    return str(_one(rng, *[""] * often, *choices)).split()


def _gop(rng: np.random.Generator) -> int:
    return int(_one(rng, 1, 2, 5, 10, 12, 15, 24, 30, 48, 60, 250))


def _x264(rng: np.random.Generator) -> Made:
    gop, crf = _gop(rng), int(rng.integers(5, 46))
    own = [f"keyint={gop}", f"min-keyint={_one(rng, 1, gop)}", f"scenecut={_one(rng, 0, 0, 40)}"]
    own += [f"bframes={rng.integers(0, 8)}", f"b-pyramid={_one(rng, 'none', 'normal', 'strict')}"]
    own += [f"cabac={_one(rng, 0, 1, 1, 1)}", f"ref={rng.integers(1, 6)}", f"weightp={rng.integers(0, 3)}"]
    own += _any(rng, "slices=2", "slices=4", "slice-max-size=400", "slice-max-mbs=40", often=3)
    own += _any(rng, "open-gop=1", "intra-refresh=1", "tff=1", "b-adapt=0", "trellis=2", often=3)
    own += _any(rng, "aq-mode=0", "no-deblock=1", "8x8dct=0", "partitions=none", "constrained-intra=1", often=3)
    options = _any(rng, "-tune zerolatency", "-tune grain", "-tune stillimage", "-tune animation")
    steady = "-b:v 800k -minrate 800k -maxrate 800k -bufsize 800k"
    rate = str(_one(rng, f"-crf {crf}", f"-crf {crf}", f"-qp {crf}", steady))
    if rate == steady:
        own.append(f"nal-hrd={_one(rng, 'cbr', 'vbr')}")
    preset = _one(rng, "ultrafast", "superfast", "veryfast", "fast", "medium", "slow")
    pix_fmt = _one(rng, "yuv420p", "yuv420p", "yuv420p", "yuvj420p", "yuv422p", "yuv444p", "yuv420p10le", "gray")
    options += ["-preset", preset, *rate.split(), "-x264-params", ":".join(own)]
    return Made("libx264", options, pix_fmt, _one(rng, "mp4", "mkv", "mov", "ts", "avi"))


def _x265(rng: np.random.Generator) -> Made:
    gop = _gop(rng)
    own = ["log-level=none", f"keyint={gop}", f"min-keyint={_one(rng, 1, gop)}", f"bframes={rng.integers(0, 6)}"]
    own += [f"crf={rng.integers(5, 46)}", f"scenecut={_one(rng, 0, 40)}", f"ctu={_one(rng, 16, 32, 64)}"]
    own += [f"open-gop={rng.integers(0, 2)}", f"ref={rng.integers(1, 4)}"]
    own += _any(rng, "wpp=1 slices=2", "sao=0", "tskip=1", "rect=1 amp=1", "lossless=1", "aq-mode=0")
    own += _any(rng, "b-pyramid=0", "weightb=1", "strong-intra-smoothing=0", "constrained-intra=1")
    options = _any(rng, "-tune zerolatency", "-tune grain")
    own += ["bframes=0"] if "zerolatency" in options else []
    preset = _one(rng, "ultrafast", "superfast", "veryfast", "fast", "medium")
    pix_fmt = _one(rng, "yuv420p", "yuv420p", "yuv422p", "yuv444p", "yuv420p10le", "gray")
    options += ["-preset", preset, "-x265-params", ":".join(own)]
    return Made("libx265", options, pix_fmt, _one(rng, "mp4", "mkv", "mov", "ts"))


def _vp9(rng: np.random.Generator) -> Made:
    options = ["-g", str(_gop(rng)), "-cpu-used", str(rng.integers(2, 9)), "-tile-columns", str(rng.integers(0, 3))]
    options += ["-deadline", _one(rng, "good", "realtime", "realtime"), "-tile-rows", str(rng.integers(0, 3))]
    rates = f"-crf {rng.integers(5, 60)} -b:v 0", "-b:v 200k", "-b:v 1M", "-b:v 4M", "-lossless 1"
    options += _one(rng, *rates, rates[0], rates[0]).split()
    options += ["-auto-alt-ref", str(rng.integers(0, 2)), "-lag-in-frames", str(_one(rng, 0, 5, 25))]
    options += _any(rng, "-aq-mode 3", "-frame-parallel 1", "-error-resilient default")
    return Made("libvpx-vp9", options, _one(rng, "yuv420p", "yuv420p", "yuv444p"), _one(rng, "webm", "mkv", "mp4"))


def _svt(rng: np.random.Generator) -> Made:
    options = ["-g", str(_gop(rng)), "-preset", str(rng.integers(6, 13)), "-crf", str(rng.integers(10, 60))]
    own = _any(rng, "tile-columns=1", "tile-rows=1", "film-grain=8", "scm=1", "fast-decode=1", often=1)
    options += ["-svtav1-params", *own] if own else []
    return Made("libsvtav1", options, _one(rng, "yuv420p", "yuv420p10le"), _one(rng, "mkv", "mp4", "webm"))


def _aom(rng: np.random.Generator) -> Made:
    options = ["-g", str(_gop(rng)), "-cpu-used", str(rng.integers(6, 9)), "-usage", _one(rng, "good", "realtime")]
    options += ["-crf", str(rng.integers(10, 60)), "-b:v", "0", "-tile-columns", str(rng.integers(0, 3))]
    options += ["-lag-in-frames", str(_one(rng, 0, 5, 19)), "-tile-rows", str(rng.integers(0, 2))]
    return Made("libaom-av1", options, "yuv420p", _one(rng, "mkv", "mp4"))


def _other(rng: np.random.Generator) -> Made:
    quality, gop = ["-q:v", str(rng.integers(2, 20))], ["-g", str(_gop(rng)), "-bf", str(rng.integers(0, 3))]
    kinds = (
        Made("mpeg2video", [*quality, *gop], "yuv420p", _one(rng, "mpg", "ts", "mxf", "mkv")),
        Made("mpeg4", [*quality, *gop], "yuv420p", _one(rng, "avi", "mp4", "mkv")),
        Made("mjpeg", quality, "yuvj420p", _one(rng, "avi", "mov", "mkv")),
        Made("prores_ks", [], "yuv422p10le", "mov"),
        Made("ffv1", ["-level", "3"], "yuv420p", _one(rng, "avi", "mkv")),
    )
    return kinds[int(rng.integers(len(kinds)))]


CODERS = {"h264": _x264, "hevc": _x265, "vp9": _vp9, "svt-av1": _svt, "aom-av1": _aom, "other": _other}
SHARES = (0.38, 0.26, 0.14, 0.08, 0.04, 0.10)


def make(folder: Path, seed: int, kinds: Collection[str]) -> tuple[str, Path, Made]:
    """A film, by its number; RuntimeError where the encoder refuses its settings."""
    rng = np.random.default_rng(seed)
    shares = np.array([share if kind in kinds else 0 for kind, share in zip(CODERS, SHARES, strict=True)])
    kind = str(rng.choice(list(CODERS), p=shares / shares.sum()))
    size = _one(rng, *SIZES)
    made = CODERS[kind](rng)
    path = folder / f"{seed}.{made.suffix}"
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{size[0]}x{size[1]}"]
    command += [
        "-r",
        "25" if made.suffix == "mxf" else "30000/1001",
        "-i",
        "-",
        "-vf",
        "scale=in_range=tv:out_range=tv",
    ]
    command += ["-c:v", made.codec, *made.options, "-pix_fmt", made.pix_fmt, "-threads", "1", str(path)]
    pictures = b"".join(picture.tobytes() for picture in film(rng, size))
    done = subprocess.run(command, input=pictures, capture_output=True, check=False)
    if done.returncode or not path.exists():
        raise RuntimeError(f"{made}: {done.stderr.decode()[-300:]}")
    return kind, path, made


class Seen(NamedTuple):
    """Pictures in all; flagged by the decoder's word; by the background; looked at again; of them found damaged;
    the processor time of the second look over that of all, s."""

    pictures: int
    flagged: int
    background: int
    asked: int
    found: int
    again: float
    whole: float


def seen_uncoded(seed: int) -> Seen:
    """What the background shows in the pictures of a film that was not coded."""
    rng = np.random.default_rng([77, seed])
    pictures = list(film(rng, _one(rng, *SIZES)))
    damage, start = DamagedPictures(8), time.process_time()
    n = sum(1 for _ in damage.over(Frame(i, Fraction(i, 30), p, False, None) for i, p in enumerate(pictures)))
    return Seen(n, 0, len(damage.indices), 0, 0, 0.0, time.process_time() - start)


def seen(path: Path, *, every: int) -> Seen:
    """What is taken for damaged in a recording."""
    asked, found, again = list[int](), set[int](), 0.0
    start = time.process_time()
    with open_video(str(path)) as video:

        def look_again(indices: Sequence[int]) -> set[int]:
            nonlocal again
            before = time.process_time()
            asked.extend(indices)
            found.update(video.look_again(indices))
            again = time.process_time() - before
            return set()

        damage, corrupt, n = DamagedPictures(video.info.bits, look_again), 0, 0
        for frame in damage.over(video.frames()):
            corrupt, n = corrupt + frame.corrupt, n + 1
    whole = time.process_time() - start
    if every:
        with av.open(str(path)) as container:
            number = container.streams.video[0].index
            stamps = [packet.pts for packet in container.demux(video=0) if packet.size]
        asked = [pts for pts in np.random.default_rng(0).permutation(stamps).tolist() if pts is not None][:every]
        found = SecondLook(str(path), number, 10**9).damaged(asked)
    return Seen(n, corrupt, len(damage.indices), len(asked), len(found), again, whole)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=150, help="films")
    parser.add_argument("--seed", type=int, default=1, help="number of the first film")
    parser.add_argument("--kinds", nargs="*", default=list(CODERS))
    words = "look at so many pictures of each, taken at random, in place of those that change suddenly"
    parser.add_argument("--every", type=int, default=0, help=words)
    parser.add_argument("--uncoded", action="store_true", help="films that are not coded")
    parser.add_argument("--files", nargs="*", type=Path, help="recordings that are there, in place of films")
    arguments = parser.parse_args()
    sums: dict[str, list[Seen]] = {}
    refused = Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for k in range(len(arguments.files) if arguments.files else arguments.count):
            if arguments.uncoded:
                one = seen_uncoded(arguments.seed + k)
                sums.setdefault("uncoded", []).append(one)
                if one.background:
                    print(f"  {arguments.seed + k}: {one}", file=sys.stderr)
                continue
            try:
                if arguments.files:
                    kind, path, made = arguments.files[k].suffix, arguments.files[k], ""
                else:
                    kind, path, made = make(Path(folder), arguments.seed + k, arguments.kinds)
            except RuntimeError as error:
                print(f"  {arguments.seed + k}: {error}", file=sys.stderr)
                refused["films that the encoder refused"] += 1
                continue
            one = seen(path, every=arguments.every)
            sums.setdefault(kind, []).append(one)
            if one.flagged or one.background or one.found:
                print(f"  {path.name} {kind}: {one} {made}", file=sys.stderr)
            if not arguments.files:
                path.unlink()
    print(f"{'':10} films pictures  alarms of: decoder background second look (pictures; looked at)   its time")
    for kind, ones in [*sorted(sums.items()), ("all", [one for own in sums.values() for one in own])]:
        alarms = [sum(bool(one[j]) for one in ones) for j in (1, 2, 4)]
        print(
            f"{kind:10} {len(ones):5} {sum(o.pictures for o in ones):8} {alarms[0]:18} {alarms[1]:10} {alarms[2]:11}"
            f" ({sum(o.found for o in ones)}; {sum(o.asked for o in ones)})"
            f" {sum(o.again for o in ones):8.2f} of {sum(o.whole for o in ones):.1f} s"
        )
    for words, count in refused.items():
        print(count, words)


if __name__ == "__main__":
    main()
