"""Files of other programs: cameras, lenses, tracks, digitised points, points of other instruments, the thesis's."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from benchmarks.fuzz.reader import Reader
from tests.exchange.cameras.rig import BROWN, RVEC, SIZE, TVEC, K
from tests.exchange.cameras.test_anipose import toml
from tests.exchange.cameras.test_dlt import written as coefficients
from tests.exchange.cameras.test_metashape import xml
from tests.exchange.cameras.test_openptv import files as openptv
from tests.exchange.points.test_c3d import positions as measured
from tests.exchange.points.test_c3d import written as c3d
from tests.exchange.points.test_qtm import markers
from tests.exchange.thesis.folder import CODES
from tests.exchange.thesis.rig import FIXED, cameras, points
from tests.exchange.thesis.test_back import BY_BACK
from tests.exchange.tracks.made import dltdv, positions, sparse
from tests.exchange.tracks.test_osp_tracker import trk
from tests.exchange.tracks.test_sleap import analysis
from tests.exchange.tracks.test_trackmate import whole
from tests.exchange.tracks.test_trackpy import saved
from vidtrack.exchange.cameras.argus import read_profiles
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said, in_world
from vidtrack.exchange.lens import known_lens
from vidtrack.exchange.points.formats import read_measured
from vidtrack.exchange.thesis.back import Listed, read_calced, read_fblocate, read_list, write_list, write_pixels
from vidtrack.exchange.thesis.camparm import Camparm, read_camparm, write_camparm
from vidtrack.exchange.thesis.location import read_location, write_location
from vidtrack.exchange.thesis.outcam import outcam_of, write_outcam
from vidtrack.exchange.thesis.points import (
    Sighted,
    Survey,
    read_targets,
    read_world,
    write_picture_points,
    write_sighted,
    write_targets,
    write_world,
)
from vidtrack.exchange.thesis.tracks import read_taped, write_taped
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks
from vidtrack.exchange.tracks.picture_points import read_points
from vidtrack.geometry.camera import project

DATA = Path(__file__).resolve().parents[2] / "tests/exchange/tracks/data"
SAID = Convention(camera="cam2", origin="upper-left", first=(1.0, 1.0), size=(640, 480), likelihood=0.6)
TAGS = tuple(str(k) for k in range(1, 25))


def _text(name: str, text: Callable[[], str], folder: Path) -> Path:
    (folder / name).write_text(text())
    return folder / name


def _made(name: str, write: Callable[[Path], object], folder: Path) -> Path:
    write(folder / name)
    return folder / name


def _copied(name: str, folder: Path) -> Path:
    return Path(shutil.copy(DATA / name, folder / name))


def _camera(path: str) -> None:
    camera = "cam1" if path.endswith("toml") else None
    sensor = {"sensor": (8.8, 6.6), "Cx": 259.5, "Cy": 241.25}
    said = Said("cam1", "m", camera=camera, origin="upper-left", first=(1.0, 1.0), size=SIZE, units="mm", **sensor)
    in_world(read_camera(path, said), said)


def _tracks(path: str) -> None:
    placed(read_tracks(path, SAID, "runs.a.tracks"), SAID, "runs.a.tracks")


def _sparse_tracks(path: str) -> None:
    said = replace(SAID, camera="2 of 3")
    placed(read_tracks(path, said, "runs.a.tracks"), said, "runs.a.tracks")


def _points(path: str) -> None:
    read_points(path, SAID, "here")


def _lens(path: str) -> None:
    known_lens({"camera": "1"} if path.endswith("txt") else {}, path, "cam1", SIZE)


def _stored(path: Path, pose: bool = True) -> None:
    values = {"image_width": SIZE[0], "image_height": SIZE[1], "camera_matrix": K, "distortion_coefficients": BROWN}
    if pose:
        values |= {"rvec": RVEC.reshape(3, 1), "tvec": TVEC.reshape(3, 1)}
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        storage.write(name, value)
    storage.release()


def _lens_json() -> str:
    return json.dumps({"camera_matrix": K.tolist(), "dist_coeffs": [BROWN.tolist()], "image_size": SIZE})


def _colmap() -> str:
    return f"# Camera list\n1 OPENCV {SIZE[0]} {SIZE[1]} 1100 1080 655.25 470.5 -0.12 0.03 6e-4 -4e-4\n"


def _profile() -> str:
    line = "{} 800.5 1280 720 639.5 359.5 1.01 -0.1 0.02 0.001 -0.002 0.003\n"
    return line.format(1) + line.format(2)


def _exported() -> str:
    rows = "".join(f"{k}\t{k / 25:.3f}\t1\t2\t{100 + k}.5\t{200 - k}.5\n" for k in range(20))
    return "frame\tt\tx\ty\tpixelx\tpixely\n" + rows


def _short_trackmate() -> str:
    marks = "".join(f'<detection t="{k}" x="{10 + k}.5" y="20" z="0"/>' for k in range(12))
    head = '<Tracks nTracks="1" spaceUnits="pixel" frameInterval="0.02" timeUnits="sec"><particle nSpots="12">'
    return f"{head}{marks}</particle></Tracks>"


def _sleap() -> str:
    rows = "".join(f"animal,{k},0.9,{10 + k},20,0.8\n" for k in range(12))
    return "track,frame_idx,instance.score,head.x,head.y,head.score\n" + rows


def _seen() -> Sighted:
    p = points()
    return Sighted(TAGS, project(cameras()[0], p), np.full(24, 30.0), p)


def _six() -> str:
    head = "NO_OF_FRAMES\t2\nNO_OF_CAMERAS\t4\nNO_OF_BODIES\t1\nFREQUENCY\t100\nNO_OF_ANALOG\t0\nANALOG_FREQUENCY\t0\n"
    head += "DESCRIPTION\t--\nTIME_STAMP\t2020-01-22, 17:47:17.250\t22107.99\nDATA_INCLUDED\t6D\nBODY_NAMES\tPSVH\n"
    head += "Frame\tTime\tPSVH X\tY\tZ\tRoll\tPitch\tYaw\tResidual" + "".join(f"\tRot[{i}]" for i in range(9)) + "\t\n"
    row = "\t-194.91974\t2.24150\t0.99661\t-0.65\t0.09\t0.05\t4.98" + "\t1.00000" * 9 + "\t\n"
    return head + "1\t0.00000" + row + "2\t0.01000" + row


CAMERAS = {
    "cam1.toml": Reader(partial(_text, "cam1.toml", toml), _camera, text=True),
    "cam1.yaml": Reader(partial(_made, "cam1.yaml", _stored), _camera, text=True),
    "cam1.xml (OpenCV)": Reader(partial(_made, "cam1.xml", _stored), _camera, text=True),
    "cam1.xml (Metashape)": Reader(partial(_text, "cam1.xml", xml), _camera, text=True),
    "cam1.ori": Reader(openptv, _camera, text=True),
    "cam1.addpar": Reader(lambda folder: openptv(folder).with_suffix(".addpar"), _camera, text=True, file="cam1.ori"),
    "cam1.csv (DLT)": Reader(
        partial(_made, "cam1.csv", lambda path: coefficients(path, "upper-left", (1, 1))), _camera, text=True
    ),
    "outcam1.prn": Reader(
        partial(_made, "outcam1.prn", lambda path: write_outcam(path, outcam_of(cameras()[0], points()).out)),
        _camera,
        text=True,
    ),
    "profile.txt (Argus)": Reader(partial(_text, "profile.txt", _profile), read_profiles, text=True),
}
LENSES = {
    "lens.yml": Reader(partial(_made, "lens.yml", partial(_stored, pose=False)), _lens, text=True),
    "lens.xml (OpenCV)": Reader(partial(_made, "lens.xml", partial(_stored, pose=False)), _lens, text=True),
    "lens.xml (Metashape)": Reader(partial(_text, "lens.xml", xml), _lens, text=True),
    "lens.json": Reader(partial(_text, "lens.json", _lens_json), _lens, text=True),
    "cameras.txt (COLMAP)": Reader(partial(_text, "cameras.txt", _colmap), _lens, text=True),
}
TRACKS = {
    "deeplabcut.csv": Reader(partial(_copied, "deeplabcut.csv"), _tracks, text=True),
    "deeplabcut_table.h5": Reader(partial(_copied, "deeplabcut_table.h5"), _tracks),
    "deeplabcut_fixed.h5": Reader(partial(_copied, "deeplabcut_fixed.h5"), _tracks),
    "sleap.h5": Reader(partial(_made, "sleap.h5", lambda path: analysis(path, positions())), _tracks),
    "sleap.csv": Reader(partial(_text, "sleap.csv", _sleap), _tracks, text=True),
    "xypts.csv (DLTdv)": Reader(partial(_text, "xypts.csv", lambda: dltdv(positions(20))), _tracks, text=True),
    "xypts.tsv (DLTdv)": Reader(partial(_text, "xypts.tsv", lambda: sparse(positions(20))), _sparse_tracks, text=True),
    "trackpy.csv": Reader(partial(_made, "trackpy.csv", lambda path: saved(path, positions(20))), _tracks, text=True),
    "tracker.trk": Reader(partial(_text, "cam1.trk", lambda: trk(positions(12))), _tracks, text=True),
    "tracker.txt": Reader(partial(_text, "cam1.txt", _exported), _tracks, text=True),
    "trackmate.xml": Reader(partial(_text, "cam1.xml", lambda: whole(positions(12))), _tracks, text=True),
    "trackmate.xml (short)": Reader(partial(_text, "cam1.xml", _short_trackmate), _tracks, text=True),
    "cam1vid.prn": Reader(
        partial(_made, "cam1vid.prn", lambda path: write_taped(path, CODES, positions(60, 1)[:, :1])),
        _tracks,
        text=True,
    ),
}
POINTS = {
    "digitised cam1.prn": Reader(
        partial(_made, "cam1.prn", lambda path: write_sighted(path, _seen())), _points, text=True
    ),
    "digitised cam.dat": Reader(
        partial(_made, "cam.dat", lambda path: write_picture_points(path, _seen())), _points, text=True
    ),
    "digitised cam1.csv": Reader(
        partial(_text, "cam1.csv", lambda: "tag,Xf,Yf,sd\n" + "".join(f"{k},{k * 7},{k * 5},0.2\n" for k in range(9))),
        _points,
        text=True,
    ),
}
INSTRUMENTS = {
    "truth.c3d": Reader(partial(_made, "truth.c3d", lambda path: c3d(path, measured())), read_measured),
    "truth.tsv (QTM)": Reader(partial(_text, "truth.tsv", markers), read_measured, text=True),
    "truth.tsv (QTM 6D)": Reader(partial(_text, "truth.tsv", _six), read_measured, text=True),
}
THESIS = {
    "camparm.dat": Reader(
        partial(_made, "camparm.dat", lambda path: write_camparm(path, Camparm((FIXED, FIXED), (148.2, 151.7)))),
        read_camparm,
        text=True,
    ),
    "balls.dat": Reader(
        partial(_made, "balls.dat", lambda path: write_targets(path, Survey(TAGS, points()))), read_targets, text=True
    ),
    "world.dat": Reader(
        partial(_made, "world.dat", lambda path: write_world(path, Survey(TAGS, points()))), read_world, text=True
    ),
    "taped.prn": Reader(
        partial(_made, "taped.prn", lambda path: write_taped(path, CODES, np.nan_to_num(positions(60, 1), nan=9.0))),
        read_taped,
        text=True,
    ),
    "location.prn": Reader(
        partial(_made, "location.prn", lambda path: write_location(path, (CODES[:20], CODES[:20]), points(20))),
        read_location,
        text=True,
    ),
    "calced.prn": Reader(partial(_text, "calced.prn", lambda: BY_BACK), read_calced, text=True),
    "list.prn": Reader(
        partial(_made, "list.prn", lambda path: write_list(path, Listed(TAGS, points(), points()))),
        read_list,
        text=True,
    ),
    "fblocate.prn": Reader(
        partial(_made, "fblocate.prn", lambda path: write_pixels(path, np.tile(_seen().b, (1, 4)), "fblocate.prn")),
        read_fblocate,
        text=True,
    ),
}
READERS: dict[str, Reader] = {**CAMERAS, **LENSES, **TRACKS, **POINTS, **INSTRUMENTS, **THESIS}
