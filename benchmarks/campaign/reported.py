"""What laboratories and bug reports describe: copied files, converted recordings, drops on a lens, slipped rows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, Scene, refilmed, run_videos, table_of

Pictures = list[np.ndarray]
Rows = list[dict[str, str]]


def _every_film(change: Callable[[Pictures, Rng], Pictures]) -> Callable[[Path, Rng], None]:
    """The run's recordings of all cameras, changed."""

    def done(folder: Path, rng: Rng) -> None:
        for path in run_videos(folder):
            refilmed(path, lambda pictures: change(pictures, rng))

    return done


def _film(change: Callable[[Pictures, Rng], Pictures], camera: int = 0) -> Callable[[Path, Rng], None]:
    """The run's recording of one camera, changed."""
    return lambda folder, rng: refilmed(run_videos(folder)[camera], lambda pictures: change(pictures, rng))


def _survey(change: Callable[[Rows], None]) -> Callable[[Path, Rng], None]:
    return lambda folder, rng: table_of(folder / "calibration/points.csv", change)


def _warped(picture: np.ndarray, zoom: float = 1.0, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    height, width = picture.shape
    M = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, zoom)
    M[:, 2] += shift
    edge = int(np.median(picture))
    return np.asarray(cv2.warpAffine(picture, M, (width, height), flags=cv2.INTER_LINEAR, borderValue=edge))


# recordings


def _breathing(pictures: Pictures, rng: Rng) -> Pictures:
    """The autofocus hunts: the picture grows and shrinks by 1.5 % before a plain wall."""
    return [_warped(p, 1 + 0.015 * np.sin(2 * np.pi * k / 40)) for k, p in enumerate(pictures)]


def _stabilised(pictures: Pictures, rng: Rng) -> Pictures:
    """A stabiliser that follows what moves: the picture wanders by some px."""
    return [_warped(p, shift=(4 * np.sin(k / 9), 3 * np.cos(k / 13) - 3)) for k, p in enumerate(pictures)]


def _copied(folder: Path, rng: Rng) -> None:
    """The recording of one camera was copied under the name of another."""
    one, other = run_videos(folder)[:2]
    other.write_bytes(one.read_bytes())


def _copied_and_coded(share: float) -> Callable[[Path, Rng], None]:
    """The recording of one camera, coded again and of another size, in the place of another."""

    def after(folder: Path, rng: Rng) -> None:
        one, other = run_videos(folder)[:2]
        refilmed(other, lambda pictures: pictures)
        other = other.with_suffix(".mkv")
        kept = one.read_bytes()
        refilmed(
            one,
            lambda pictures: [cv2.resize(p, None, fx=share, fy=share, interpolation=cv2.INTER_AREA) for p in pictures],
        )
        one.with_suffix(".mkv").replace(other)
        one.write_bytes(kept)

    return after


def _dropped(pictures: Pictures, rng: Rng) -> Pictures:
    """A capture card drops a tenth of the pictures, and stamps the rest evenly."""
    return [p for k, p in enumerate(pictures) if k < 3 or rng.random() > 0.1]


def _another_repeat(pictures: Pictures, rng: Rng) -> Pictures:
    """The recording of another repeat of the test, which began at the same hour: here the same in reverse."""
    return pictures[::-1]


def _paused(pictures: Pictures, rng: Rng) -> Pictures:
    """Recording was interrupted for 0.4 s, and the code goes on as if it had not been."""
    return pictures[:25] + pictures[37:]


def _blended(pictures: Pictures, rng: Rng) -> Pictures:
    """Converted from another rate: every third picture is a mixture of two."""
    return [
        p if k % 3 or not k else ((p.astype(int) + pictures[k - 1]) // 2).astype(np.uint8)
        for k, p in enumerate(pictures)
    ]


def _averaged(pictures: Pictures, rng: Rng) -> Pictures:
    """Noise reduction over time: each picture is the mean of the last three."""
    return [np.mean(pictures[max(k - 2, 0) : k + 1], axis=0).astype(np.uint8) for k in range(len(pictures))]


def _out_of_order(pictures: Pictures, rng: Rng) -> Pictures:
    """Pictures in the order in which they were coded, not shown."""
    out = list(pictures)
    for k in range(2, len(out) - 1, 3):
        out[k], out[k + 1] = out[k + 1], out[k]
    return out


def _black_first(pictures: Pictures, rng: Rng) -> Pictures:
    return [np.full_like(p, 2) if k < 8 else p for k, p in enumerate(pictures)]


def _flash(pictures: Pictures, rng: Rng) -> Pictures:
    return [np.clip(p.astype(int) + (150 if k in (20, 21) else 0), 0, 255).astype(np.uint8)
            for k, p in enumerate(pictures)]  # fmt: skip


def _gain_hunts(pictures: Pictures, rng: Rng) -> Pictures:
    return [np.clip(p * (1 + 0.35 * np.sin(k / 6)), 0, 255).astype(np.uint8) for k, p in enumerate(pictures)]


def _hot_pixels(pictures: Pictures, rng: Rng) -> Pictures:
    x, y = rng.integers(0, 384, 60), rng.integers(0, 288, 60)
    out = [p.copy() for p in pictures]
    for p in out:
        p[y, x] = 250
    return out


def _drop_on_lens(pictures: Pictures, rng: Rng) -> Pictures:
    """A drop of water on the lens: what is behind it is displaced by 2 px and blurred."""
    y, x = np.mgrid[0:288, 0:384].astype(np.float32)
    cx, cy = rng.uniform(150, 230), rng.uniform(110, 170)
    inside = np.exp(-(((x - cx) ** 2 + (y - cy) ** 2) / 45**2)).astype(np.float32)
    far = (x + 2.5 * inside).astype(np.float32), (y + 1.5 * inside).astype(np.float32)
    return [cv2.remap(p, *far, cv2.INTER_LINEAR) for p in pictures]


def _burnt_in(pictures: Pictures, rng: Rng) -> Pictures:
    """A counter is burnt into the picture."""
    out = [p.copy() for p in pictures]
    for k, p in enumerate(out):
        cv2.putText(p, f"10:00:{k / 30:05.2f}", (8, 282), cv2.FONT_HERSHEY_SIMPLEX, 0.7, 235, 2)
    return out


def _frozen_with_noise(pictures: Pictures, rng: Rng) -> Pictures:
    """A converter repeats a picture for a third of a second, and its own noise hides that from bit-wise comparison."""
    return [
        np.clip(pictures[20] + rng.normal(0, 2, p.shape), 0, 255).astype(np.uint8) if 20 < k < 30 else p
        for k, p in enumerate(pictures)
    ]


def _knocked_slightly(pictures: Pictures, rng: Rng) -> Pictures:
    """The camera was touched between its calibration and the run: by a pixel, before a plain wall."""
    return [_warped(p, shift=(1.0, 0.5)) for p in pictures]


def _lens_corrected(pictures: Pictures, rng: Rng) -> Pictures:
    """The camera's own correction of its lens was switched on after the calibration: 3 % at the picture's edge."""
    y, x = np.mgrid[0:288, 0:384].astype(np.float32)
    dx, dy = x - 191.5, y - 143.5
    grown = 1 + 0.03 * (dx**2 + dy**2) / 192.0**2
    at = (191.5 + dx * grown).astype(np.float32), (143.5 + dy * grown).astype(np.float32)
    return [cv2.remap(p, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) for p in pictures]


def _another_code(camera: int, code: str | None, skipped: int = 0) -> Callable[[Path, Rng], None]:
    """A recording with another time code or none, or trimmed at its beginning while the code stayed."""

    def after(folder: Path, rng: Rng) -> None:
        tape = {} if code else {"timecode": "none"}
        refilmed(run_videos(folder)[camera], lambda pictures: pictures[skipped:], code or "10:00:00:00", **tape)

    return after


def _hard_coded(scene: Scene, rng: Rng) -> None:
    scene["recording"]["tape"] = {"codec": "mjpeg", "container": "mov", "options": {"qscale": 28}}


def _clock(camera: str, **clock: float) -> Callable[[Scene, Rng], None]:
    def before(scene: Scene, rng: Rng) -> None:
        scene["cameras"][camera]["clock"] = clock

    return before


# calibration


def _one_clip(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Path, Rng], None]:
    """One clip of the points of one camera, changed."""

    def after(folder: Path, rng: Rng) -> None:
        path = next((folder / "calibration/rear").glob("cam1.m*"))
        refilmed(path, lambda pictures: [np.ascontiguousarray(change(p)) for p in pictures])

    return after


def _two_percent(picture: np.ndarray) -> np.ndarray:
    return _warped(picture, 1.02)


def _halved(picture: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA))


def _leaning(rows: Rows) -> None:
    """The frame leans by a degree, and was measured along itself."""
    for row in rows:
        row["x"] = str(float(row["x"]) + 0.0175 * float(row["z"]))


def _rows_slipped(rows: Rows) -> None:
    """A cell was inserted: the coordinates of a third of the tags are the next tag's."""
    for axis in "xyz":
        values = [row[axis] for row in rows]
        for k in range(12, 23):
            rows[k][axis] = values[k + 1]


def _rounded(rows: Rows) -> None:
    for row in rows:
        row |= {axis: str(float(round(float(row[axis]) - 0.3))) for axis in "xyz"}
        row["sigma"] = "0.01"


def _station_misread(rows: Rows) -> None:
    """All points of one clip were hung 0.7 in farther along than is written."""
    for row in rows[24:36]:
        row["y"] = str(float(row["y"]) + 0.7)


def _column_in_cm(rows: Rows) -> None:
    for row in rows:
        row["x"] = str(2.54 * float(row["x"]))


def _sigma_in_mm(rows: Rows) -> None:
    for row in rows:
        row["sigma"] = str(25.4 * max(float(row["sigma"]), 0.01))


def _offset_of_a_column(rows: Rows) -> None:
    """Depths of the rear half were measured from another datum."""
    for row in rows[18:]:
        row["z"] = str(float(row["z"]) + 0.5)


def _names_of_cameras(path: str) -> Callable[[Path, Rng], None]:
    def change(rows: Rows) -> None:
        other = {"cam1": "cam2", "cam2": "cam1"}
        for row in rows:
            row["camera"] = other.get(row["camera"], row["camera"])

    return lambda folder, rng: table_of(folder / path, change)


def _boxed(scene: Scene, rng: Rng) -> None:
    scene["runs"]["test"]["boxes"] = True


def _with(**values: Any) -> Callable[[Scene, Rng], None]:
    return lambda scene, rng: scene["picture"].update(values)


TIME = r"clock|time code|timecode|synchron|later|earlier|rate"
SIGHTS = r"lines of sight|line of sight|sight|moved|zoom|epipolar|disagree"
SURVEY = r"survey|points\.csv|misplaced|tag|deformed"
REPORTED: dict[str, Circumstance] = {
    "autofocus-hunts": Circumstance(SIGHTS, after=_film(_breathing), harmless=True),
    "stabiliser-on": Circumstance(SIGHTS, after=_film(_stabilised), harmless=True),
    "recording-copied": Circumstance(r"same|copy|copied|identical", after=_copied),
    "recording-coded-again": Circumstance(r"one film", after=_copied_and_coded(1.0)),
    "recording-made-smaller": Circumstance(r"one film|outside the picture", after=_copied_and_coded(0.5)),
    "pictures-dropped-silently": Circumstance(r"missing", after=_film(_dropped), harmless=True),
    "repeats-mixed": Circumstance(SIGHTS + "|" + TIME, after=_film(_another_repeat), harmless=True),
    "recording-paused": Circumstance(SIGHTS + "|" + TIME + "|jump|missing", after=_film(_paused), harmless=True),
    "frames-blended": Circumstance(
        SIGHTS + "|blend|mixture|merged|residual|miss", after=_film(_blended), harmless=True
    ),
    "all-averaged": Circumstance(r"mean of several|mixed|late", after=_every_film(_averaged), harmless=True),
    "frames-out-of-order": Circumstance(SIGHTS + "|order|" + TIME, after=_film(_out_of_order), harmless=True),
    "black-first": Circumstance(r"black|dark|located|measured|lost", after=_film(_black_first), harmless=True),
    "flash": Circumstance(r"flash|light|located|measured|lost", after=_film(_flash), harmless=True),
    "gain-hunts": Circumstance(r"light|gain|bright|saturat|located", after=_film(_gain_hunts), harmless=True),
    "hot-pixels": Circumstance(r"static|pixel|located|found", after=_film(_hot_pixels), harmless=True),
    "drop-on-lens": Circumstance(SIGHTS, after=_film(_drop_on_lens), harmless=True),
    "counter-burnt-in": Circumstance(r"more|target|located|found", after=_film(_burnt_in), harmless=True),
    "coded-hard": Circumstance(r"noise|contrast|located|miss", _hard_coded, harmless=True),
    "clock-runs-fast": Circumstance(TIME, _clock("cam2", rate_ppm=5000.0), harmless=True),
    "half-a-frame-late": Circumstance(TIME, _clock("cam2", offset_s=1 / 60), harmless=True),
    "clip-zoomed": Circumstance(SURVEY + "|clip|zoom|moved", after=_one_clip(_two_percent), harmless=True),
    "clip-half-size": Circumstance(r"size|scale|px", after=_one_clip(_halved), harmless=True),
    "frame-leans": Circumstance(r"deformed|angle", after=_survey(_leaning), harmless=True),
    "rows-slipped": Circumstance(SURVEY, after=_survey(_rows_slipped)),
    "survey-rounded": Circumstance(SURVEY + "|sigma|residual", after=_survey(_rounded), harmless=True),
    "station-misread": Circumstance(SURVEY, after=_survey(_station_misread), harmless=True),
    "column-in-cm": Circumstance(r"scaled|Sx|deformed|unit", after=_survey(_column_in_cm)),
    "sigma-in-mm": Circumstance(r"sigma|toleran", after=_survey(_sigma_in_mm), harmless=True),
    "datum-changed": Circumstance(SURVEY, after=_survey(_offset_of_a_column), harmless=True),
    "picks-of-another-camera": Circumstance(
        r"pick|camera", after=_names_of_cameras("calibration/front/picks.csv"), harmless=True
    ),
    "boxes-of-another-camera": Circumstance(
        r"box|start|measured|located|match", _boxed, _names_of_cameras("runs/test/targets.csv"), harmless=True
    ),
    "frozen-with-noise": Circumstance(SIGHTS + "|repeat|froz", after=_film(_frozen_with_noise), harmless=True),
    "knocked-slightly": Circumstance(SIGHTS + "|turned", after=_film(_knocked_slightly), harmless=True),
    "lens-corrected": Circumstance(SIGHTS + "|lens|turned", after=_film(_lens_corrected), harmless=True),
    "code-missing-in-one": Circumstance(TIME, after=_another_code(0, None), harmless=True),
    "code-two-hours-off": Circumstance(r"time zone|apart", after=_another_code(-1, "12:00:00:00")),
    "trimmed-with-old-code": Circumstance(r"clock", after=_another_code(-1, "10:00:00:00", 15)),
    "light-uneven": Circumstance(r"bright|located", _with(gradient=(60.0, 40.0)), harmless=True),
}
