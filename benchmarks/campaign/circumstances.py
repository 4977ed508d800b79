"""What may be wrong with an experiment: each circumstance spoils a scenario before it is filmed, or its folder after.

`named` are words of which one must stand in what the user reads; a circumstance that is `harmless` may as well be
handled so that all numbers are right.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from benchmarks.campaign.changes import (
    Circumstance,
    Rng,
    Scene,
    config_of,
    film_without_loss,
    refilmed,
    run_videos,
    table_of,
)
from benchmarks.campaign.edited import EDITED
from benchmarks.campaign.instruments import INSTRUMENTS
from benchmarks.campaign.light import LIGHT
from benchmarks.campaign.mixed_up import MIXED_UP
from benchmarks.campaign.played import PLAYED
from benchmarks.campaign.rain import RAIN
from benchmarks.campaign.reported import REPORTED
from benchmarks.campaign.scenes import APART, DURATION_S, RATE, gap_of, motion_of
from benchmarks.campaign.slight import SLIGHT

# pictures


def _half_size(folder: Path, rng: Rng) -> None:
    for path in run_videos(folder):
        refilmed(
            path, lambda pictures: [cv2.resize(p, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for p in pictures]
        )


def _cropped(folder: Path, rng: Rng) -> None:
    for path in run_videos(folder):
        refilmed(path, lambda pictures: [np.ascontiguousarray(p[24:-24, 32:-32]) for p in pictures])


def _letterbox(folder: Path, rng: Rng) -> None:
    for path in run_videos(folder):
        refilmed(path, lambda pictures: [np.ascontiguousarray(p[36:-36]) for p in pictures])


def _repeated(folder: Path, rng: Rng) -> None:
    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        answer = list(pictures)
        for k in range(5, len(pictures), 9):
            answer[k] = answer[k - 1]
        return answer

    refilmed(run_videos(folder)[0], change)


def _stuck(folder: Path, rng: Rng) -> None:
    refilmed(run_videos(folder)[0], lambda p: [*p[: len(p) // 2], *[p[len(p) // 2]] * (len(p) - len(p) // 2)])


def _knocked(folder: Path, rng: Rng) -> None:
    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        half = len(pictures) // 2
        return [p if k < half else np.roll(p, (3, 5), (0, 1)) for k, p in enumerate(pictures)]

    refilmed(run_videos(folder)[0], change)


def _dim(scene: Scene, rng: Rng) -> None:
    scene["picture"] |= {"contrast": 20.0, "noise": 4.0}


def _saturated(scene: Scene, rng: Rng) -> None:
    scene["picture"] |= {"contrast": 330.0}


# time


def _codes_differ(folder: Path, rng: Rng) -> None:
    refilmed(run_videos(folder)[-1], lambda p: p, "10:00:00;00")


def _rate_of_ntsc(scene: Scene, rng: Rng) -> None:
    scene["recording"]["rate"] = "30000/1001"


def _no_code(scene: Scene, rng: Rng) -> None:
    scene["recording"]["tape"]["timecode"] = "none"
    scene["runs"]["test"]["first_frame"] = {name: 4 * k for k, name in enumerate(scene["cameras"])}


def _wrong_clock(folder: Path, rng: Rng) -> None:
    config_of(folder, lambda c: c["cameras"]["cam2"].update(clock={"offset_s": 0.1, "rate_ppm": 0.0}))


def _late_camera(scene: Scene, rng: Rng) -> None:
    scene["cameras"]["cam2"]["clock"] = {"offset_s": 0.05}


def _lost_frames(scene: Scene, rng: Rng) -> None:
    count = int(DURATION_S * RATE)
    scene["runs"]["test"]["lost_frames"] = {
        "cam1": sorted(rng.choice(np.arange(3, count - 3), 4, replace=False).tolist())
    }


def _fields_exchanged(scene: Scene, rng: Rng) -> None:
    scene["recording"] |= {"rate": "30000/1001", "interlace": "bottom"}


def _say_top(folder: Path, rng: Rng) -> None:
    config_of(folder, lambda c: c.update(detect={"fields": "top"}))


# survey and calibration


def _point_misplaced(folder: Path, rng: Rng) -> None:
    def change(rows: list[dict[str, str]]) -> None:
        rows[17]["x"] = str(float(rows[17]["x"]) + 2.0)

    table_of(folder / "calibration/points.csv", change)


def _wire_misplaced(folder: Path, rng: Rng) -> None:
    def change(rows: list[dict[str, str]]) -> None:
        for row in rows[15:18]:
            row["y"] = str(float(row["y"]) + 3.0)

    table_of(folder / "calibration/points.csv", change)


def _mirrored(folder: Path, rng: Rng) -> None:
    def change(rows: list[dict[str, str]]) -> None:
        for row in rows:
            row["x"] = str(-float(row["x"]))

    table_of(folder / "calibration/points.csv", change)


def _survey_in_cm(folder: Path, rng: Rng) -> None:
    def change(rows: list[dict[str, str]]) -> None:
        for row in rows:
            row |= {axis: str(2.54 * float(row[axis])) for axis in ("x", "y", "z", "sigma")}

    table_of(folder / "calibration/points.csv", change)


def _picks_swapped(folder: Path, rng: Rng) -> None:
    def change(rows: list[dict[str, str]]) -> None:
        own = [row for row in rows if row["camera"] == "cam1"]
        own[0]["tag"], own[-1]["tag"] = own[-1]["tag"], own[0]["tag"]

    table_of(folder / "calibration/front/picks.csv", change)


def _points(**plan: Any) -> Callable[[Scene, Rng], None]:
    def before(scene: Scene, rng: Rng) -> None:
        rows, wires, balls = (plan.get(key, 3) for key in ("rows", "wires", "balls"))
        scene["calibration"]["points"] |= {"rows": rows, "wires": wires, "balls": balls}
        count = rows * wires * balls
        picks = ", ".join(str(n) for n in dict.fromkeys([1, 2, max(3, count // 2), count - 1, count]))
        scene["calibration"]["clips"] = {"all": {"tags": f"1-{count}", "picks": picks}}

    return before


def _rolled(scene: Scene, rng: Rng) -> None:
    for clip in scene["calibration"]["clips"].values():
        clip["moved"] = {"cam1": [[0, 0, 0], [0, 0, 1.3]]}


def _turned_a_little(scene: Scene, rng: Rng) -> None:
    for clip in scene["calibration"]["clips"].values():
        clip["moved"] = {"cam1": [[0, 0, 0], [0.15, 0.15, 0]]}


def _textured(scene: Scene, rng: Rng) -> None:
    scene["texture"] = {"contrast": float(rng.uniform(6, 15)), "grain_px": float(rng.uniform(1.5, 3))}


def _turned_between(scene: Scene, rng: Rng) -> None:
    _textured(scene, rng)
    turn = [float(v) for v in rng.uniform(0.05, 0.6, 3) * rng.choice([-1, 1], 3)]
    for clip in scene["calibration"]["clips"].values():
        clip["moved"] = {"cam1": [[0, 0, 0], turn]}


def _turned_in_run(scene: Scene, rng: Rng) -> None:
    _textured(scene, rng)
    turn = [float(v) for v in rng.uniform(0.05, 0.6, 3) * rng.choice([-1, 1], 3)]
    begun = float(rng.uniform(0.3, 1.2))
    ended = begun + float(rng.choice([0.05, 0.5]))
    scene["runs"]["test"]["turned"] = {"cam1": [[begun, 0, 0, 0, 0], [ended, *turn, 0]]}


def _follow(folder: Path, rng: Rng) -> None:
    config_of(folder, lambda c: c["calibration"].update(follow=True))


def _wide_lens(scene: Scene, rng: Rng) -> None:
    for camera in scene["cameras"].values():
        camera |= {"kappa1": 9e-3, "kappa2": 5e-4}


def _side_by_side(scene: Scene, rng: Rng) -> None:
    first = scene["cameras"]["cam1"]
    second = {**first, "pan_deg": first["pan_deg"] + 3.0}
    scene["cameras"] = {"cam1": first, "cam2": second}


# targets


def _two_targets(scene: Scene, rng: Rng) -> None:
    run = scene["runs"]["test"]
    run["boxes"] = True
    while True:
        run["targets"] = {f"t{k + 1}": {"diameter": 1.6, "motion": motion_of(rng, k, 2)} for k in range(2)}
        if gap_of(scene) >= APART:
            return


def _touching(scene: Scene, rng: Rng) -> None:
    run, n = scene["runs"]["test"], int(rng.integers(2, 4))
    while True:
        run["targets"] = {f"t{k + 1}": {"diameter": 1.6, "motion": motion_of(rng, k, n)} for k in range(n)}
        if gap_of(scene) < 0:
            return


def _names_exchanged(folder: Path, rng: Rng) -> None:
    def change(rows: list[dict[str, str]]) -> None:
        other = {"t1": "t2", "t2": "t1"}
        for row in rows:
            if row["camera"] == "cam2":
                row["target"] = other[row["target"]]

    table_of(folder / "runs/test/targets.csv", change)


def _without_boxes(scene: Scene, rng: Rng) -> None:
    _two_targets(scene, rng)
    scene["runs"]["test"]["boxes"] = False


def _ask(count: int) -> Callable[[Path, Rng], None]:
    def after(folder: Path, rng: Rng) -> None:
        config_of(folder, lambda c: c["runs"]["test"].update(targets=count))

    return after


def _slow_start(scene: Scene, rng: Rng) -> None:
    _two_targets(scene, rng)
    run = scene["runs"]["test"]
    run["boxes"] = bool(rng.random() < 0.5)
    run["targets"]["t1"]["motion"] = {"at": [0, -6, 0], "path": [[0.5, 0, 0, 0], [2.0, 8, 0, 2]]}


def _crossing(scene: Scene, rng: Rng) -> None:
    swing = {"along": [1, 0, 0], "amplitude": 9, "hz": 0.4, "phase_deg": -90}
    scene["runs"]["test"] |= {
        "boxes": True,
        "targets": {
            "t1": {"diameter": 1.6, "motion": {"at": [0, -1.5, 1], "oscillations": [swing]}},
            "t2": {"diameter": 1.6, "motion": {"at": [0, 1.5, -1], "oscillations": [{**swing, "amplitude": -9}]}},
        },
    }


def _blind(scene: Scene, rng: Rng) -> None:
    names = scene["runs"]["test"]["targets"]
    scene["runs"]["test"]["hidden"] = [{"camera": "cam1", "target": name, "from_s": 0.7, "to_s": 1.3} for name in names]


def _stranger(scene: Scene, rng: Rng) -> None:
    scene["runs"]["test"]["boxes"] = True
    scene["runs"]["test"]["others"] = {
        "stranger": {"diameter": 1.6, "motion": {**motion_of(rng, 0, 1), "at": [0, 14, 2]}}
    }


def _nothing_in_view(scene: Scene, rng: Rng) -> None:
    for target in scene["runs"]["test"]["targets"].values():
        target["motion"]["at"] = [400.0, 400.0, 0.0]
    scene["runs"]["test"]["boxes"] = False


def _far_out(scene: Scene, rng: Rng) -> None:
    for target in scene["runs"]["test"]["targets"].values():
        target["motion"]["at"][0] += 17.0
        target["motion"]["at"][2] += 6.0


def _with_reference(scene: Scene, rng: Rng) -> None:
    run = scene["runs"]["test"]
    name = next(iter(run["targets"]))
    run["targets"] = {name: run["targets"][name]}
    run["duration_s"] = 3.0
    run["targets"][name]["motion"]["oscillations"][0] |= {"along": [1, 0, 0], "amplitude": 8.0}
    run["reference"] = {"target": name, "column": "x_in", "rate": 30, "error": 0.03, "lead_s": 0.2}


def _reference_in_cm(folder: Path, rng: Rng) -> None:
    def change(rows: list[dict[str, str]]) -> None:
        for row in rows:
            row["x_in"] = str(2.54 * float(row["x_in"]))

    table_of(folder / "runs/test/reference.csv", change)


TIME = r"clock|time code|timecode|synchron|later|earlier"
CIRCUMSTANCES: dict[str, Circumstance] = {
    "none": Circumstance(""),
    "picture-half-size": Circumstance(r"size|scale|px", after=_half_size),
    "picture-cropped": Circumstance(r"size|crop|px", after=_cropped),
    "picture-letterbox": Circumstance(r"size|crop|shape|aspect", after=_letterbox),
    "frames-repeated": Circumstance(r"repeat|identical|same picture", film_without_loss, _repeated, harmless=True),
    "recording-stuck": Circumstance(r"repeat|identical|stuck|same picture", film_without_loss, _stuck),
    "camera-knocked-in-run": Circumstance(r"moved|knock|camera|line of sight|lines of sight", after=_knocked),
    "contrast-low": Circumstance(r"contrast|noise|threshold|measured|located", _dim, harmless=True),
    "saturated": Circumstance(r"saturat", _saturated, harmless=True),
    "codes-differ": Circumstance(r"drop|time code|timecode|common", _rate_of_ntsc, _codes_differ),
    "code-missing": Circumstance(TIME, _no_code, harmless=True),
    "clock-wrong-in-config": Circumstance(TIME, after=_wrong_clock),
    "camera-late": Circumstance(TIME, _late_camera),
    "frames-lost": Circumstance(r"lost|missing|dropped|frames", _lost_frames, harmless=True),
    "fields-exchanged": Circumstance(r"field", _fields_exchanged, _say_top),
    "survey-point": Circumstance(r"\b18\b", after=_point_misplaced),
    "survey-wire": Circumstance(r"\b1[678]\b", after=_wire_misplaced),
    "survey-mirrored": Circumstance(r"mirror|left-handed|handed", after=_mirrored),
    "survey-in-cm": Circumstance(r"unit|gain|times as|scale", _with_reference, _survey_in_cm),
    "picks-swapped": Circumstance(r"swap|pick|exchang", after=_picks_swapped, harmless=True),
    "points-in-a-plane": Circumstance(r"plane|coplanar", _points(rows=1, wires=6, balls=5)),
    "points-few": Circumstance(r"point", _points(rows=1, wires=2, balls=3)),
    "points-on-a-line": Circumstance(r"line|wire", _points(rows=1, wires=1, balls=9)),
    "camera-rolled": Circumstance(r"moved|roll|calibration|line of sight|lines of sight", _rolled),
    "camera-turned-a-little": Circumstance(r"moved|turn|calibration|line of sight|lines of sight", _turned_a_little),
    "background-textured": Circumstance("", _textured, harmless=True),
    "camera-moved-between": Circumstance(r"moved between", _turned_between),
    "camera-moved-along-run": Circumstance(r"moved during the run", _turned_in_run),
    "camera-followed": Circumstance("", _turned_in_run, _follow, harmless=True),
    "lens-wide": Circumstance(r"lens|model|distort", _wide_lens, harmless=True),
    "base-line-small": Circumstance(r"parallel|base line|baseline|angle", _side_by_side, harmless=True),
    "names-exchanged": Circumstance(r"name|exchang|swap", _two_targets, _names_exchanged),
    "targets-fewer-asked": Circumstance(r"target|seen|asked", _without_boxes, _ask(1)),
    "targets-more-asked": Circumstance(r"target|found|asked|located", _without_boxes, _ask(3)),
    "slow-start": Circumstance("", _slow_start, harmless=True),
    "touching": Circumstance(r"touch|merged|met|samples were located", _touching, harmless=True),
    "crossing": Circumstance(r"merged|cross|close", _crossing, harmless=True),
    "camera-blind": Circumstance(r"lost|hidden|located|seen", _blind, harmless=True),
    "stranger": Circumstance(r"target|stranger|more", _stranger, harmless=True),
    "nothing-in-view": Circumstance(r"measured|found|target|located", _nothing_in_view),
    "out-of-volume": Circumstance(r"volume|outside|picture|points cover", _far_out, harmless=True),
    "reference-in-cm": Circumstance(r"unit|gain|times", _with_reference, _reference_in_cm),
    "reference-late": Circumstance("", _with_reference, harmless=True),
    **MIXED_UP,
    **LIGHT,
    **SLIGHT,
    **EDITED,
    **REPORTED,
    **INSTRUMENTS,
    **RAIN,
    **PLAYED,
}
