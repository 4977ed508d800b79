"""A run as the writers take it: three targets, one of them with a name that is not ASCII, gaps, flags, a body."""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from vidtrack.exchange.measured import Run
from vidtrack.geometry.camera import Camera

START, RATE = 50409.992967, 60000 / 1001
NAMES = ("bow", "Bälle é", "stern")


def times(n=60):
    return np.round(START + np.arange(n) / RATE, 6)


def trajectories(names=NAMES, n=60, seed=1, t=None):
    """Sample 5 of every target is missing with a flag, 7 of the first one has no row, 20 to 24 have none at all."""
    rng = np.random.default_rng(seed)
    t = times(n) if t is None else t
    tables = []
    for i, name in enumerate(names):
        p = rng.normal(scale=30, size=(len(t), 3))
        table = pd.DataFrame({"time_s": t, "timecode": "14:00:09:29", "target": name})
        table[["x", "y", "z"]] = p
        table[["sigma_x", "sigma_y", "sigma_z"]] = rng.uniform(1e-3, 2e-3, (len(t), 3))
        table["miss"] = rng.uniform(0, 5e-3, len(t))
        table["n_cameras"] = 3
        table["flag"] = ""
        table.loc[5, ["x", "y", "z", "sigma_x", "sigma_y", "sigma_z", "miss"]] = np.nan
        table.loc[5, "flag"] = "lost;cam1:edge"
        table.loc[6, "flag"] = "cam2:saturated"
        tables.append(table.drop(index=[*range(20, 25), *([7] if i == 0 else [])], errors="ignore"))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame({"time_s": [], "target": []})


def bodies(names=("float",), n=60, seed=2):
    rng = np.random.default_rng(seed)
    tables = []
    for name in names:
        angles = rng.uniform(-60, 60, (n, 3))
        q = Rotation.from_euler("ZYX", angles[:, ::-1], degrees=True).as_quat(canonical=True)
        table = pd.DataFrame({"time_s": times(n), "timecode": "14:00:09:29", "body": name})
        table[["x", "y", "z"]] = rng.normal(scale=10, size=(n, 3))
        table[["roll", "pitch", "yaw"]] = angles
        table[["qw", "qx", "qy", "qz"]] = q[:, [3, 0, 1, 2]]
        table["rms"] = 0.01
        table["covariance"] = list(np.tile(np.eye(6).ravel() * 1e-6, (n, 1)))
        table["n_targets"] = 3
        table["flag"] = ""
        gone = ["x", "y", "z", "roll", "pitch", "yaw", "qw", "qx", "qy", "qz", "rms"]
        table.loc[5, gone] = np.nan
        table.loc[5, "flag"] = "missing"
        tables.append(table.drop(index=range(20, 25)))
    return pd.concat(tables, ignore_index=True)


def kinematics(seed=3):
    table = trajectories()[["time_s", "target", "x", "y", "z"]]
    rng = np.random.default_rng(seed)
    for name in ("vx", "vy", "vz", "ax", "ay", "az"):
        table[name] = rng.normal(size=len(table))
        table[f"sigma_{name}"] = 0.1
    return table


def run(units="in", **changes):
    tables = {"trajectories": trajectories(), "kinematics": kinematics(), "bodies": bodies()}
    return Run("pluck", units, **({"tables": tables, "provenance": {"vidtrack": "1.2.3"}} | changes))


def camera(name="cam1", pan=20.0, kappa1=6e-4, **changes):
    """A camera 160 units from the origin that looks at it from above."""
    R = Rotation.from_euler("zx", [pan, -115.0], degrees=True).inv().as_matrix()
    given = {"Cx": 262.0, "Cy": 233.0, "dx": 8.8 / 512, "dy": 6.6 / 480, "Sx": 1.02, "f": 11.0, "kappa1": kappa1}
    given |= {"R": R, "T": np.array([1.0, 2.0, 160.0]), "image_size": (512, 480), "name": name}
    return Camera(**(given | changes))
