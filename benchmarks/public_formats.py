"""Public files of other programs, read and compared with independent readers.

    PYTHONPATH=. python benchmarks/public_formats.py FOLDER

FOLDER holds whatever of these is there; none of it is kept in the project.

    dltCoefs.csv xypts.csv xyzpts.csv   three cameras, DLTdv 7: thejasvibr/projectushichka,
                                        acoustic-tracking/2018-08-17/speaker_playbacks
    *.c3d                               pyomeca/ezc3d (Qualisys.c3d, markers_analogs.c3d): against ezc3d
    *_6D.tsv                            shiplab/dt_cv, data/basin/raw: against pandas
    *profile.csv                        Argus' libraries of lenses, kilmoretrout/argus_gui, resources/calibrations
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.argus import read_profiles
from vidtrack.exchange.cameras.dlt import coefficients_of, frame_buffer
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said
from vidtrack.exchange.points.c3d import read as read_c3d
from vidtrack.exchange.points.qtm import read as read_qtm
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks

SIZE = (640, 512)


def main(folder: Path) -> None:
    """Print a line for each file that is there."""
    if (folder / "dltCoefs.csv").is_file():
        dltdv(folder)
    for path in sorted(folder.glob("*.c3d")):
        c3d(path)
    for path in sorted(folder.glob("*_6D.tsv")):
        qtm(path)
    for path in sorted(folder.glob("*profile.csv")):
        try:
            print(f"{path.name}: {len(read_profiles(path))} lenses")
        except VidtrackError as error:  # omnidirectional lenses
            print(error)


def dltdv(folder: Path) -> None:
    """The set's own xyz from its coefficients and points, after both went through vidtrack's cameras and frame
    buffer."""
    A = frame_buffer("lower-left", (1, 1), SIZE)
    L, b = [], []
    for k in "123":
        camera = read_camera(folder / "dltCoefs.csv", Said(f"cam{k}", "m", "dltdv", k, size=SIZE)).camera
        f = camera.f
        K = np.array([[f * camera.Sx, f * camera.skew, camera.Cx], [0, f, camera.Cy], [0, 0, 1]])
        L.append(coefficients_of(np.linalg.inv(A) @ K @ np.column_stack([camera.R, camera.T])))
        said = Convention(camera=k, origin="lower-left", size=SIZE)
        own = placed(read_tracks(folder / "xypts.csv", said, "here"), said, "here")[:, 0]
        b.append((np.column_stack([own, np.ones(len(own))]) @ np.linalg.inv(A).T)[:, :2])
    theirs = pd.read_csv(folder / "xyzpts.csv").to_numpy()
    worst = 0.0
    known = np.flatnonzero(np.isfinite(theirs).all(1))
    for i in known:
        rows, right = [], []
        for own, uv in zip(L, np.array(b)[:, i], strict=True):
            if np.isfinite(uv).all():
                rows += [uv[0] * own[8:11] - own[0:3], uv[1] * own[8:11] - own[4:7]]
                right += [own[3] - uv[0], own[7] - uv[1]]
        worst = max(worst, float(np.abs(np.linalg.lstsq(np.array(rows), np.array(right))[0] - theirs[i]).max()))
    print(f"DLTdv: {len(known)} positions, largest difference from its own xyz {worst:.2g}")


def c3d(path: Path) -> None:
    """Against ezc3d."""
    import ezc3d

    own = read_c3d(path)
    theirs = np.moveaxis(ezc3d.c3d(str(path))["data"]["points"][:3], (0, 1, 2), (2, 1, 0))
    same = own.p.shape == theirs.shape and np.array_equal(own.p, theirs, equal_nan=True)
    print(f"{path.name}: {own.p.shape[0]} frames, {own.p.shape[1]} points, {'equal to' if same else 'NOT AS'} ezc3d")


def qtm(path: Path) -> None:
    """Against pandas."""
    own = read_qtm(path)
    theirs = pd.read_csv(path, sep="\t", skiprows=10, encoding="latin-1").to_numpy()[:, 2:5].astype(float)
    print(f"{path.name}: {len(own.p)} frames, largest difference {np.nanmax(np.abs(own.p[:, 0] - theirs)):.2g}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
