"""Files that people write, and the results that later rules read: config, tables, records."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.io import savemat

from benchmarks.fuzz.reader import Reader
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.files.camera_json import read_camera, write_camera
from vidtrack.files.channel_files import read_channels
from vidtrack.files.config_file import read_config
from vidtrack.files.csv_checked import checked_csv, read_header
from vidtrack.files.csv_columns import CAMPAIGN, PROFILE, reference_record
from vidtrack.files.labelling_json import read_labelling
from vidtrack.files.records import read_json, read_png, write_png
from vidtrack.files.tables import (
    read_csv,
    read_parquet,
    read_picks,
    read_points,
    read_targets,
    read_truth,
    read_units,
    write_parquet,
)
from vidtrack.files.timestack_file import read_timestacks, write_timestacks
from vidtrack.geometry.camera import project
from vidtrack.planning.sensitivity_plan import read_sensitivity
from vidtrack.settings.board import board_from_values
from vidtrack.settings.config import settings_from_config
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.simulate.scenario import scenario_from
from vidtrack.workflow.fingerprint import Checksums
from vidtrack.workflow.provenance import Account, Order, read_account, write_account

HOUSE = Path(__file__).resolve().parents[2]

CONFIG = """\
title: a float in waves
units: in
experiment: .
cameras:
  cam1: {Cx: 256.0, Cy: 240.0, sensor: [8.8, 6.6], clock: {offset_s: 0.1, rate_ppm: 5}, through: [window]}
  cam2:
    sensor: [8.8, 6.6]
    rate: 29.97
interfaces:
  window: {point: [0, 0, 0], normal: [0, 1, 0], indices: [1.0, 1.49, 1.333], thickness: 0.5}
detect: {polarity: bright, threshold: auto, centroid: weighted, min_pixels: 4, box: [50, 50], fields: auto, end: null}
calibration:
  sigma: 0.03
  model: tsai
  refine: full
  clips:
    row1: {tags: 1-16, threshold: 90}
    row2: {tags: [17, 18, "A1-A4"]}
axes: {waves: +x, up: +z}
export: [c3d, netcdf]
runs:
  pluck:
    targets: [bow, stern]
    reference: {time: time_s, value: x_in, axis: x, target: bow}
    bodies: {float: {bow: [0, 0, 0], stern: [6, 0, 0], mid: [0, 6, 0]}}
    channels: {file: daq.csv, time: t, columns: {eta: eta_m}}
  flat: {mode: plane, plane: {scale: 0.14, aspect: 1.25}, detect: {start: "10:00:00:10"}}
"""
BOARD = "type: charuco\ncolumns: 8\nrows: 6\nsquare: 30.0\nmarker: 20\ndictionary: DICT_5X5_250\nworld: board/0\n"
ROWS = "".join(f"{tag},{2.5 * tag},{-tag / 3:.4f},{tag % 4},0.03\n" for tag in range(1, 13))
RECORD = pd.DataFrame({"t": np.arange(60) / 50, "eta_m": np.sin(np.arange(60)), "load_N": np.arange(60.0)})
NAMES = {"eta": "eta_m", "load": "load_N"}


def _text(name: str, text: str, folder: Path) -> Path:
    (folder / name).write_text(text)
    return folder / name


def _table(name: str, text: str, read: Callable[[str], object]) -> Reader:
    return Reader(partial(_text, name, text), read, text=True)


def _config(path: str) -> None:
    settings_from_config(read_config(path))


def _scenario(path: str) -> None:
    scenario_from(read_config(path), path)


def _reference(path: str) -> None:
    read_header(path)
    read_csv(path, reference_record("time_s", "x_in"), others="ignore")


def _camera(folder: Path) -> Path:
    camera = thesis_rig(1)[0]
    p = thesis_points()[1]
    fit = refine(camera, p, project(camera, p), free=free_parameters("brown"))
    write_camera(folder / "camera.json", fit.camera, fit.uncertainty, {"model": "brown"}, {"vidtrack": "0"})
    record = read_json(folder / "camera.json")  # without its checksum, which would refuse nearly all that is changed
    (folder / "camera.json").write_text(json.dumps(record, indent=1))
    return folder / "camera.json"


def _account(folder: Path) -> Path:
    order = Order('{"box":[50,50]}', '{"runs/a/cam1.mov":"00"}', '{"code":"11"}')
    write_account(str(folder / "account"), Account(order, {"results/a": "22"}, {"results/b": "33"}))
    return folder / "account"


def _checksums(folder: Path) -> Path:
    (folder / "file").write_text("a")
    known = Checksums(str(folder / "checksums.json"))
    known.of(str(folder / "file"))
    known.save()
    return folder / "checksums.json"


def _of_checksums(path: str) -> None:
    Checksums(path).of(str(Path(path).with_name("file")))


def _parquet(folder: Path) -> Path:
    n = 200
    table = pd.DataFrame(
        {"frame": np.arange(n), "time_s": np.arange(n) / 30, "target": ["t1"] * n, "Xf": np.sin(np.arange(n))}
    )
    table["flag"] = np.where(np.arange(n) % 7, "", "lost")
    table["axes"] = [[1.0, float(k)] for k in range(n)]
    write_parquet(folder / "centroids.parquet", table, units="in", provenance={"vidtrack": "0"})
    return folder / "centroids.parquet"


def _of_parquet(path: str) -> None:
    read_parquet(path)
    read_units(path)


def _png(folder: Path) -> Path:
    write_png(folder / "background.png", np.arange(64 * 48, dtype=np.uint16).reshape(48, 64))
    return folder / "background.png"


def _stacks(folder: Path) -> Path:
    stack = {"grey": np.arange(600, dtype=np.uint8).reshape(20, 30), "time_s": np.arange(20.0), "s": np.arange(30.0)}
    write_timestacks(folder / "timestacks.npz", {"middle": stack})
    return folder / "timestacks.npz"


def _channels(ending: str, folder: Path) -> Path:
    path = folder / f"daq.{ending}"
    if ending == "csv":
        RECORD.to_csv(path, index=False)
    elif ending == "parquet":
        RECORD.to_parquet(path)
    elif ending == "mat":
        savemat(path, {"daq": {name: RECORD[name].to_numpy() for name in RECORD}, "m": np.eye(3), "s": "text"})
    else:
        from nptdms import ChannelObject, TdmsWriter

        clock = {"wf_increment": 0.02, "wf_start_offset": 0.0}
        with TdmsWriter(str(path)) as file:
            file.write_segment([ChannelObject("basin", n, RECORD[n].to_numpy(), properties=clock) for n in RECORD])
    return path


def _of_channels(path: str) -> None:
    names: dict[str, Any] = NAMES
    time: str | None = "t"
    if path.endswith("mat"):
        names, time = {channel: f"daq.{name}" for channel, name in NAMES.items()}, "daq.t"
    elif path.endswith("tdms"):
        time = None
    read_channels(path, names, time=time)


READERS: dict[str, Reader] = {
    "config.yaml": _table("config.yaml", CONFIG, _config),
    "board.yaml": _table("board.yaml", BOARD, lambda path: board_from_values(read_config(path, "columns"), path)),
    "scenario.yaml": Reader(
        partial(_text, "scenario.yaml", (HOUSE / "data/demo.yaml").read_text()), _scenario, text=True
    ),
    "sensitivity.yaml": Reader(
        partial(_text, "rig.yaml", (HOUSE / "data/sensitivity/thesis.yaml").read_text()), read_sensitivity, text=True
    ),
    "points.csv": _table("points.csv", "tag,x,y,z,sigma\n" + ROWS, partial(read_points, units="in")),
    "picks.csv": _table(
        "picks.csv", "camera,tag,Xf,Yf,sd\n" + "cam1,1,20.5,30,\ncam1,2,200,30.25,0.4\ncam2,1,33,44,\n", read_picks
    ),
    "targets.csv": _table(
        "targets.csv",
        "camera,target,Xf,Yf,width,height\ncam1,t1,20.5,30,40,40\ncam2,t1,200,30.25,,\n",
        partial(read_targets, camera="cam1", size=(512, 480)),
    ),
    "truth.csv": _table(
        "truth.csv", "time_s,target,x,y,z\n" + "".join(f"{k / 30:.4f},t1,{k},2,3\n" for k in range(20)), read_truth
    ),
    "reference.csv": _table(
        "reference.csv", "time_s,x_in\n" + "".join(f"10:00:{k:02d}.5,{k / 7:.3f}\n" for k in range(20)), _reference
    ),
    "runs.csv": _table(
        "runs.csv",
        "run,H,T,heading,scale,repeat,notes\na,0.1,1.2,0,50,1,calm\nb,0.2,1.5,30,50,2,\n",
        partial(checked_csv, columns=CAMPAIGN, others="ignore"),
    ),
    "profile.csv": _table(
        "profile.csv",
        "x,y,z\n0,0,0\n1,0,0.1\n2,0,0.3\n",
        partial(checked_csv, columns=PROFILE, others="ignore", units="m"),
    ),
    **{
        f"daq.{e}": Reader(partial(_channels, e), _of_channels, text=e == "csv")
        for e in ("csv", "parquet", "mat", "tdms")
    },
    "camera.json": Reader(_camera, read_camera, text=True),
    "labelling.json": _table(
        "labelling.json", json.dumps({"clips": {"row1": {"named": 4}}, "findings": []}), read_labelling
    ),
    "record.json": _table(
        "record.json", json.dumps({"findings": [{"level": "note", "code": "a", "text": "b"}], "n": 1.5}), read_json
    ),
    "account": Reader(_account, read_account, text=True),
    "checksums.json": Reader(_checksums, _of_checksums, text=True),
    "centroids.parquet": Reader(_parquet, _of_parquet),
    "background.png": Reader(_png, read_png),
    "timestacks.npz": Reader(_stacks, read_timestacks),
}
