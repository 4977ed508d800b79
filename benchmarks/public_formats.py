"""Public files of other programs, read and compared with independent readers.

    PYTHONPATH=. python benchmarks/public_formats.py [FOLDER]

Files that may be kept lie in tests/exchange/public (its README has sources and licences). FOLDER holds whatever else is
at hand, under the names of `FILES`, which says where each is public; none of it is kept in the project.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import cv2
import h5py
import numpy as np
import pandas as pd
import yaml
from scipy.optimize import linprog

from vidtrack.exchange.cameras.argus import read_profiles
from vidtrack.exchange.cameras.dlt import coefficients_of, frame_buffer
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said
from vidtrack.exchange.lens_files import read_lens
from vidtrack.exchange.points.formats import read_measured
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks
from vidtrack.geometry.brown import distorted
from vidtrack.geometry.camera import project

KEPT = Path(__file__).parent.parent / "tests/exchange/public"


class Compared(NamedTuple):
    """How many numbers were compared, the largest difference, its unit, and the most that is allowed."""

    numbers: int
    largest: float
    unit: str
    limit: float
    with_: str


class Public(NamedTuple):
    """A public file: its format, its name in the folder, where it is public, and the comparison."""

    format: str
    file: str
    source: str
    compare: Callable[[Path], Compared]


def dltdv(path: Path) -> Compared:
    """The set's own xyz from its coefficients and points, after both went through vidtrack's cameras and frame buffer.

    Its pixels have six decimals, too, and DLTdv had more of them: each point is compared with the nearest that pixels
    give which are printed as these.
    """
    size = (640, 512)
    A = frame_buffer("lower-left", (1, 1), size)
    L, b = [], []
    for k in "123":
        camera = read_camera(path.with_name("dltCoefs.csv"), Said(f"cam{k}", "m", "dltdv", k, size=size)).camera
        f = camera.f
        K = np.array([[f * camera.Sx, f * camera.skew, camera.Cx], [0, f, camera.Cy], [0, 0, 1]])
        L.append(coefficients_of(np.linalg.inv(A) @ K @ np.column_stack([camera.R, camera.T])))
        said = Convention(camera=k, origin="lower-left", size=size)
        own = placed(read_tracks(path, said, "here"), said, "here")[:, 0]
        b.append((np.column_stack([own, np.ones(len(own))]) @ np.linalg.inv(A).T)[:, :2])
    theirs = pd.read_csv(path.with_name("xyzpts.csv")).to_numpy()
    uv = np.stack(b, 1)
    known = np.flatnonzero(np.isfinite(theirs).all(1))
    off, same = [], 0
    for i in known:
        seen = np.isfinite(uv[i]).all(-1)
        own = located(np.array(L)[seen], uv[i, seen])
        same += int((np.round(own, 6) == theirs[i]).sum())
        off.append(nearest(np.array(L)[seen], uv[i, seen], theirs[i]))
    reader = f"DLTdv 7's own xyz, within its pixels' last digit ({same} equal from the pixels as printed)"
    return Compared(3 * len(known), float(np.max(off)), "m", 5e-7, reader)


def nearest(L: np.ndarray, uv: np.ndarray, p: np.ndarray, half: float = 5e-7) -> float:
    """How near a point can come to p (its worst coordinate), its pixels anywhere within half their last digit."""
    n, own = uv.size, located(L, uv)
    J = np.array([located(L, uv + 1e-3 * e.reshape(-1, 2)) - own for e in np.eye(n)]).T / 1e-3
    A = np.block([[J, -np.ones((3, 1))], [-J, -np.ones((3, 1))]])
    d = (own - p) / half
    best = linprog(np.eye(n + 1)[-1], A, np.concatenate([-d, d]), bounds=[(-1, 1)] * n + [(0, None)])
    return float(np.abs(located(L, uv + half * best.x[:-1].reshape(-1, 2)) - p).max())


def located(L: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """A point (3,) by the direct linear transformation, from L (c, 11) and uv (c, 2)."""
    A = np.concatenate([np.outer(b, own[8:11]) - own[:8].reshape(2, 4)[:, :3] for b, own in zip(uv, L, strict=True)])
    return np.linalg.lstsq(A, np.concatenate([own[[3, 7]] - b for b, own in zip(uv, L, strict=True)]))[0]


def c3d(path: Path) -> Compared:
    """Positions, names and rate, against ezc3d."""
    import ezc3d

    own, theirs = read_measured(path), ezc3d.c3d(str(path))
    rate = theirs["parameters"]["POINT"]["RATE"]["value"][0]
    assert [name.strip() for name in theirs["parameters"]["POINT"]["LABELS"]["value"]] == list(own.names)
    assert np.allclose(own.time_s, np.arange(len(own.p)) / rate)
    return differing(own.p, np.moveaxis(theirs["data"]["points"][:3], (0, 1, 2), (2, 1, 0)), "mm", 0.0, "ezc3d")


def qtm(path: Path) -> Compared:
    """Positions of the body, or of all markers, against pandas; the times against the file's own column."""
    own = read_measured(path)
    head = next(i for i, line in enumerate(path.read_text("latin-1").splitlines()) if line.startswith("Frame\t"))
    table = pd.read_csv(path, sep="\t", skiprows=head, encoding="latin-1")
    first = [table.columns.get_loc(f"{name} X") for name in own.names]
    theirs = np.stack([table.iloc[:, at : at + 3] for at in first], 1)
    assert np.allclose(own.time_s, table["Time"], atol=5.1e-6)
    return differing(own.p, np.asarray(theirs, float), "mm", 0.0, "pandas")


def profile(path: Path) -> Compared:
    """Every lens of a library of Argus, against cv2.projectPoints with the numbers that pandas reads."""
    table = pd.read_csv(path)
    own, theirs = [], []
    for profile, (_, row) in zip(read_profiles(path), table.iterrows(), strict=True):
        f, w, h, cx, cy, aspect, k1, k2, t1, t2, k3 = (float(v) for v in row.iloc[1:12])
        K = np.array([[f, 0, cx], [0, f * aspect, cy], [0, 0, 1]])
        x = grid(w / f / 2, h / f / 2)
        own.append(distorted(profile.lens, x))
        theirs.append(opencv_sees(x, K, np.array([k1, k2, t1, t2, k3])))
    return differing(np.array(own), np.array(theirs), "px", 1e-9, "pandas and cv2.projectPoints")


def deeplabcut(path: Path) -> Compared:
    """Every point of every frame, against pandas."""
    said = Convention(likelihood=0.6)
    own = read_tracks(path, said, "here")
    table = pd.read_csv(path, header=[0, 1, 2], index_col=0)
    table.columns = table.columns.droplevel(0)
    theirs = np.stack([table[name][["x", "y"]].to_numpy() for name in own.names], 1)
    theirs[np.stack([table[name]["likelihood"].to_numpy() < 0.6 for name in own.names], 1)] = np.nan
    assert list(own.frame) == list(table.index)
    return differing(placed(own, said, "here"), theirs, "px", 0.0, "pandas")


def sleap(path: Path) -> Compared:
    """Every node of every frame, against h5py."""
    own = read_tracks(path, Convention(), "here")
    with h5py.File(path) as file:
        raw = np.asarray(file["tracks"])
    return differing(own.b, np.transpose(raw, (3, 0, 2, 1)).reshape(raw.shape[3], -1, 2), "px", 0.0, "h5py")


def sleap_io(path: Path) -> Compared:
    """Every node, HDF5 and CSV, against what sleap-io reads: single precision."""
    theirs = pd.read_csv(path.with_name("sleap_io.csv"))
    off, limit = [], 600 * 2.0**-24
    for file in (path, path.with_name("tank.csv")):
        tracks = read_tracks(file, Convention(first=(0, 0)), "here")
        names = [f"{t}_{n}" for t, n in zip(theirs["track"], theirs["node"], strict=True)]
        at = [tracks.names.index(name) for name in names]
        off.append(tracks.b[np.searchsorted(tracks.frame, theirs["frame"]), at] - theirs[["x", "y"]].to_numpy())
        assert np.isfinite(tracks.b).all(-1).sum() == len(theirs)
    return differing(np.array(off), np.zeros_like(off), "px", limit, "sleap-io 0.9.5")


def anipose(path: Path) -> Compared:
    """All cameras, where their lenses do not fold, against cv2.projectPoints with the numbers that tomllib reads.

    The limit is what the reader itself says that its refit leaves.
    """
    import tomllib

    own, theirs, stated = [], [], 0.0
    for section in tomllib.loads(path.read_text()).values():
        if "matrix" not in section:
            continue
        K, d = np.array(section["matrix"]), np.array(section["distortions"])
        rvec, T = np.array(section["rotation"]), np.array(section["translation"])
        x = grid(*(0.6 * s / 2 / f for s, f in zip(section["size"], np.diag(K), strict=False)))
        c = np.column_stack([x, np.ones(len(x))]) * 300
        p = (c - T) @ cv2.Rodrigues(rvec)[0]
        given = read_camera(path, Said("cam1", "mm", camera=section["name"]))
        stated = max(stated, given.largest_px)
        own.append(project(given.camera, p))
        theirs.append(cv2.projectPoints(p, rvec, T, K, d)[0][:, 0])
    return differing(np.array(own), np.array(theirs), "px", stated, "tomllib and cv2.projectPoints")


def aniposelib(path: Path) -> Compared:
    """All cameras, one of them fisheye, against aniposelib."""
    return cameras_seeing(path.with_name("aniposelib.csv"), lambda name: (path, Said(name, "mm")), "aniposelib 0.8.0")


def openptv(path: Path) -> Compared:
    """Four cameras against OpenPTV's own library; the matrix in the files has seven decimals, the last half 3e-4 px."""

    def said(k: str) -> tuple[Path, Said]:
        return path.with_name(f"cam{k}.tif.ori"), Said(f"cam{k}", "mm", size=(1280, 1024), sensor=(15.36, 12.288))

    return cameras_seeing(path.with_name("optv.csv"), said, "optv 0.3.2", corner=0.5, digits=3e-4)


def cameras_seeing(
    table: Path, said: Callable[[str], tuple[Path, Said]], reader: str, corner: float = 0.0, digits: float = 1e-6
) -> Compared:
    """Points of a table (camera, x, y, z, u, v) through our cameras, against its u, v; the limit is the refit's own.

    corner   what the centre of the top-left pixel is in u and v
    digits   px, what the last digit of the file means
    """
    rows = pd.read_csv(table)
    own, stated = np.empty((len(rows), 2)), digits
    for name, part in rows.groupby(rows.columns[0]):
        given = read_camera(*said(str(name)))
        stated = max(stated, given.largest_px)
        own[part.index] = project(given.camera, part[["x", "y", "z"]].to_numpy())
    return differing(own, rows[["u", "v"]].to_numpy() - corner, "px", stated, reader)


def opencv(path: Path) -> Compared:
    """The lens against cv2.FileStorage and cv2.projectPoints."""
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    K, d = file.getNode("camera_matrix").mat(), file.getNode("distortion_coefficients").mat()
    return lens_seeing(path, "s10Leo", K, d.ravel(), "cv2.FileStorage, cv2.projectPoints")


def ros(path: Path) -> Compared:
    """The lens against PyYAML and cv2.projectPoints."""
    own = yaml.safe_load(path.read_text())
    K = np.array(own["camera_matrix"]["data"]).reshape(3, 3)
    d = np.array(own["distortion_coefficients"]["data"])
    return lens_seeing(path, "bb2_left", K, d, "PyYAML, cv2.projectPoints")


def lens_seeing(path: Path, camera: str, K: np.ndarray, d: np.ndarray, reader: str) -> Compared:
    """A lens of ours against OpenCV's, over the picture."""
    lens, _ = read_lens(str(path), camera)
    x = grid(K[0, 2] / K[0, 0] * 0.8, K[1, 2] / K[1, 1] * 0.8)
    return differing(distorted(lens, x), opencv_sees(x, K, d), "px", 1e-9, reader)


def colmap(path: Path) -> Compared:
    """Two fisheye cameras against cv2.fisheye, half a pixel apart."""
    own, theirs = [], []
    for row in (line.split() for line in path.read_text().splitlines() if not line.startswith("#")):
        fx, fy, cx, cy, *k = (float(v) for v in row[4:])
        x = grid(1.2, 1.2)
        K = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
        own.append(distorted(read_lens(str(path), row[0])[0], x))
        theirs.append(cv2.fisheye.distortPoints(x[:, None], K, np.array(k))[:, 0])
    return differing(np.array(own), np.array(theirs), "px", 1e-9, "cv2.fisheye.distortPoints")


def trackmate(path: Path) -> Compared:
    """Every link between two spots, against the table of links that was exported beside the XML."""
    links = pd.read_csv(path.with_suffix(".csv"))
    tracks = read_tracks(path, Convention(), "here")
    b = placed(tracks, Convention(), "here")
    off = []
    for end in ("source", "target"):
        rows = np.searchsorted(tracks.frame, links[f"{end}_frame"])
        p = links[[f"{end}_position_x", f"{end}_position_y"]].to_numpy()
        track = [[n.split(".")[0] == f"track{t}" for n in tracks.names] for t in links["track_id"]]
        away = np.where(np.array(track)[..., None], np.abs(b[rows] - p[:, None]), np.nan)
        off.append(np.nanmin(away.max(-1), 1))
    return differing(np.array(off), np.zeros((2, len(links))), "px", 1e-9, "the exported links")


def trackpy(path: Path) -> Compared:
    """Every particle, against pandas."""
    tracks, table = read_tracks(path, Convention(), "here"), pd.read_csv(path)
    at = [tracks.names.index(f"p{n}") for n in table["particle"]]
    own = placed(tracks, Convention(), "here")[np.searchsorted(tracks.frame, table["frame"]), at]
    return differing(own, table[["x", "y"]].to_numpy(), "px", 0.0, "pandas")


def metashape(path: Path) -> Compared:
    """All aligned cameras of one sensor against the manual's equations, written out."""
    root = ElementTree.parse(path).getroot()
    chunk = root.find("chunk")
    sensor = chunk.find("sensors/sensor")
    part = next(c for c in sensor.iter("calibration") if c.get("class") == "adjusted")
    size = [int(part.find("resolution").get(side)) for side in ("width", "height")]
    names = ("f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2")
    v = {name: float(part.findtext(name) or 0) for name in names}
    turn = chunk.find("transform")
    own, theirs, stated = [], [], 0.0
    for element in chunk.iter("camera"):
        if element.find("transform") is None or element.get("sensor_id") != sensor.get("id"):
            continue
        M = np.array(element.findtext("transform").split(), float).reshape(4, 4)
        x = grid(0.45 * size[0] / v["f"], 0.45 * size[1] / v["f"])
        p = np.column_stack([x, np.ones(len(x))]) * 2 @ M[:3, :3].T + M[:3, 3]
        if turn is not None and turn.findtext("scale"):
            Q = np.array(turn.findtext("rotation").split(), float).reshape(3, 3)
            p = float(turn.findtext("scale")) * p @ Q.T + np.array(turn.findtext("translation").split(), float)
        said = Said("cam1", "m", camera=Path(element.get("label")).stem, units="m")
        given = read_camera(path, said)
        stated = max(stated, given.largest_px)
        own.append(project(given.camera, p))
        r2 = (x**2).sum(1)
        gain = 1 + r2 * (v["k1"] + r2 * (v["k2"] + r2 * (v["k3"] + r2 * v["k4"])))
        X = x[:, 0] * gain + v["p1"] * (r2 + 2 * x[:, 0] ** 2) + 2 * v["p2"] * x[:, 0] * x[:, 1]
        Y = x[:, 1] * gain + v["p2"] * (r2 + 2 * x[:, 1] ** 2) + 2 * v["p1"] * x[:, 0] * x[:, 1]
        u = size[0] / 2 + v["cx"] + X * v["f"] + X * v["b1"] + Y * v["b2"]
        theirs.append(np.column_stack([u, size[1] / 2 + v["cy"] + Y * v["f"]]) - 0.5)
    return differing(np.array(own), np.array(theirs), "px", stated, "the manual's equations")


def grid(across: float, down: float, n: int = 15) -> np.ndarray:
    """Tangents (n n, 2) over a picture that reaches so far from its middle."""
    side = np.linspace(-1, 1, n)
    return np.stack(np.meshgrid(side * across, side * down), -1).reshape(-1, 2)


def opencv_sees(x: np.ndarray, K: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Where OpenCV sees the directions x (n, 2)."""
    rays = np.column_stack([x, np.ones(len(x))])
    return cv2.projectPoints(rays, np.zeros(3), np.zeros(3), K, d)[0][:, 0]


def differing(own: np.ndarray, theirs: np.ndarray, unit: str, limit: float, reader: str) -> Compared:
    """The comparison of two arrays; numbers that only one of them has are refused."""
    own, theirs = np.asarray(own), np.asarray(theirs)
    if own.shape != theirs.shape or not (np.isfinite(own) == np.isfinite(theirs)).all() or not np.isfinite(own).any():
        return Compared(own.size, np.inf, unit, limit, reader)
    return Compared(int(np.isfinite(own).sum()), float(np.nanmax(np.abs(own - theirs))), unit, limit, reader)


SPEAKER = "thejasvibr/projectushichka, acoustic-tracking/2018-08-17/speaker_playbacks (three thermal cameras, DLTdv 7)"
ANIPOSE = "talmolab/sleap-anipose, tests/data/minimal_session"
FILES = (
    Public("DLTdv 7, DLT coefficients", "xypts.csv", SPEAKER, dltdv),
    Public("C3D", "Qualisys.c3d", "pyomeca/ezc3d, test/c3dFiles", c3d),
    Public("C3D", "markers_analogs.c3d", "pyomeca/pyomeca, tests/data", c3d),
    Public("QTM TSV", "M510A_6D.tsv", "shiplab/dt_cv, data/basin/raw", qtm),
    Public(
        "Argus profile", "argus_profile.csv", "kilmoretrout/argus_gui, resources/calibrations, Hero3 White", profile
    ),
    Public("DeepLabCut CSV", "deeplabcut.csv", "biol-jsh/DLC-DLTdv-workflow, windtunnelTrials/April 1", deeplabcut),
    Public("SLEAP HDF5", "back.analysis.h5", ANIPOSE, sleap),
    Public("anipose TOML", "calibration.toml", ANIPOSE, anipose),
    Public("Metashape XML", "cameras.xml", "bitbyt3r/metashape-automation", metashape),
    Public("OpenPTV .ori, .addpar", "openptv/cam1.tif.ori", "pyptv, tests/test_cavity", openptv),
    Public("OpenCV YAML", "opencv/s10.yml", "kapture, samples/cour_carree_markers", opencv),
    Public("ROS camera_info", "ros/bb2_left.yaml", "kapture, samples/utbm", ros),
    Public("COLMAP cameras.txt", "colmap/cameras.txt", "kapture, samples/t265", colmap),
    Public("TrackMate XML", "trackmate/trackmate_tracks_with_splitting.xml", "laptrack, tests/data", trackmate),
    Public("QTM TSV", "qtm/dance.tsv", "mopipe, tests/fixtures", qtm),
    Public("Argus profile", "argus/hero4_black.csv", "argus_gui, resources/calibrations", profile),
    Public("anipose TOML", "ammonkey/calibration.toml", "ammonkey, cfgs", anipose),
    Public("anipose TOML", "anipose/calibration.toml", "written by aniposelib", aniposelib),
    Public("SLEAP HDF5, CSV", "sleap/tank.analysis.h5", "written by sleap-io", sleap_io),
    Public("trackpy CSV", "trackpy/tracks.csv", "written by trackpy", trackpy),
)


def found(folders: list[Path]) -> list[tuple[Public, Path]]:
    """The files that are in one of the folders."""
    return [(file, folder / file.file) for file in FILES for folder in folders if (folder / file.file).is_file()]


def main(folders: list[Path]) -> None:
    """Print a line for each file that is there."""
    for file, path in found([KEPT, *folders]):
        own = file.compare(path)
        met = "" if own.largest <= own.limit else "   NOT MET"
        print(
            f"{file.format:<26} {own.numbers:>7} numbers, largest difference {own.largest:.3g} {own.unit} "
            f"(limit {own.limit:.3g}) from {own.with_}; {file.source}{met}"
        )


if __name__ == "__main__":
    main([Path(folder) for folder in sys.argv[1:]])
