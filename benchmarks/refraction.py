"""Cameras that look into water: errors beside the floor, sigma, speed, OpenPTV on the same rays, a real tank.

    python benchmarks/refraction.py accuracy --trials 10   window, surface and wall against cameras that are exact
    python benchmarks/refraction.py place                  interfaces stated elsewhere along their normals
    python benchmarks/refraction.py wrong --trials 4       thickness or an index stated wrongly
    python benchmarks/refraction.py speed                  points a second, as a ratio to cameras in air
    python benchmarks/refraction.py openptv                the same rays through OpenPTV's multimedia model (needs optv)
    python benchmarks/refraction.py real                   proptv_rbc4cam, with and without an interface

Accuracy: two cameras, 64 surveyed points and 0.1 px; the interface is known to 5 mm, 0.5 degrees and 0.001, a pane to
3 % and 0.005, and is given as far off as that. 500 other points are located; the floor is their error from cameras and
interfaces that are known exactly.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.shared_survey import Survey, joint_covariance
from vidtrack.stages.calibrate import Calibration, calibrate

REAL = Path(__file__).parents[1] / "../shared/real/points/proptv_rbc4cam"
WINDOW = Interface("window", np.array([0.0, -500, 0]), np.array([0.03, 1, 0.01]), (1.0, 1.49, 1.333), (30.0,))
SURFACE = Interface("surface", np.array([0.0, 0, 120]), np.array([0.0, 0, 1]), (1.0, 1.333))
FRONT = Interface("front", np.array([0.0, -450, 0]), np.array([0.0, 1, 0]), (1.0, 1.52, 1.333), (12.0,))
SIDE = Interface("side", np.array([-450.0, 0, 0]), np.array([1.0, 0, 0]), (1.0, 1.52, 1.333), (12.0,))


def looking(position: tuple[float, float, float], *through: Interface) -> Camera:
    """A camera, mm, that looks at the origin."""
    place = np.array(position, float)
    z = -place / np.linalg.norm(place)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    R = np.array([x, np.cross(z, x), z])
    return Camera(320, 240, 0.01, 0.01, 1.01, 8.0, 1e-4, R, -R @ place, (640, 480), through=through)


RIGS = {
    "air": (looking((-500, -1500, 50)), looking((500, -1500, -100))),
    "window": (looking((-500, -1500, 50), WINDOW), looking((500, -1500, -100), WINDOW)),
    "surface": (looking((-600, -700, 1500), SURFACE), looking((700, -500, 1500), SURFACE)),
    "wall": (looking((-300, -1500, 50), FRONT), looking((-1500, -200, -100), SIDE)),
}


def config(interface: Interface, rng: np.random.Generator) -> dict[str, object]:
    """The interface as it is measured by hand."""
    tilt = rng.normal(0, np.radians(0.5), 2) @ interface.axes
    own: dict[str, object] = {
        "name": interface.name,
        "point": interface.point + interface.normal * rng.normal(0, 5),
        "normal": interface.normal + tilt,
        "indices": (*interface.indices[:-1], interface.indices[-1] + rng.normal(0, 0.001)),
    }
    if interface.thickness:
        own["thickness"] = tuple(t * (1 + rng.normal(0, 0.03)) for t in interface.thickness)
        own["indices"] = tuple(n + rng.normal(0, 0.005 * (0 < k < 2)) for k, n in enumerate(own["indices"]))  # type: ignore[arg-type]
    return own


def grid() -> Array:
    """64 calibration points, all in the water."""
    line = np.linspace(-200, 200, 4)
    return np.stack(np.meshgrid(line, line, np.linspace(-200, 110, 4)), -1).reshape(-1, 3)


def calibrated(
    cameras: tuple[Camera, ...], rng: np.random.Generator, modelled: bool, off: float | None = None
) -> list[Calibration]:
    """Each camera from its own view of the grid, interfaces given where they are modelled.

    off  mm, by which they are stated elsewhere along their normal; None: as off as a hand measurement leaves them
    """
    p = grid()
    given = {i.name: config(i, rng) for camera in cameras for i in camera.through}
    if off is not None:
        for i in {i.name: i for camera in cameras for i in camera.through}.values():
            given[i.name] |= {"point": i.point + off * i.normal, "normal": i.normal, "indices": i.indices}
    done = []
    for camera in cameras:
        table = pd.DataFrame({"tag": [str(k) for k in range(len(p))], "sd_x": 0.1, "sd_y": 0.1})
        table[["x", "y", "z"]], table[["Xf", "Yf"]] = p, project(camera, p) + rng.normal(0, 0.1, (len(p), 2))
        through = [given[i.name] for i in camera.through] if modelled else []
        lens = {"image_size": (640, 480), "sensor": (6.4, 4.8), "model": "tsai" if modelled else "auto"}
        done.append(calibrate(table, through=through, units="mm", search=False, **lens))
    return done


def accuracy(trials: int) -> None:
    print(f"{'':8} {'':10} {'mean mm':>8} {'floor':>7} {'ratio':>6} {'scatter over sigma':>20}  found")
    for name, cameras in RIGS.items():
        for modelled in (True, False) if name != "air" else (True,):
            error, floor, z, codes = [], [], [], set()
            for trial in range(trials):
                rng = np.random.default_rng(trial)
                found = calibrated(cameras, rng, modelled)
                q = rng.uniform([-180, -180, -180], [180, 180, 100], (500, 3))
                b = np.array([project(c, q) for c in cameras]) + rng.normal(0, 0.1, (2, 500, 2))
                known = [c.uncertainty for c in found]
                tags = tuple(str(k) for k in range(64))
                surveys = [Survey(tags, grid(), np.zeros(64), 0.1)] * 2
                joint = joint_covariance([c.camera for c in found], known, surveys)
                ours = locate_points([c.camera for c in found], b, sd=0.1, uncertainties=known, joint=joint)
                error.append(np.linalg.norm(ours.point - q, axis=-1).mean())
                floor.append(np.linalg.norm(locate_points(cameras, b, sd=0.1).point - q, axis=-1).mean())
                z.append((((ours.point - q) / ours.sigma) ** 2).mean(0))
                codes |= {f.code for c in found for f in c.findings if f.code.startswith("interface")}
            scatter = " ".join(f"{each:.2f}" for each in np.sqrt(np.mean(z, 0)))
            e, f = np.mean(error), np.mean(floor)
            kind = "modelled" if modelled else "not"
            print(f"{name:8} {kind:10} {e:8.3f} {f:7.3f} {e / f:6.3f} {scatter:>20}  {', '.join(sorted(codes))}")


def place(trials: int) -> None:
    print(f"{'':8} {'off mm':>7} {'ratio to the floor':>19} {'scatter over sigma':>19} {'camera off mm':>14}  found")
    for name, cameras in RIGS.items():
        for off in (0.0, 20.0, 60.0, 150.0) if name != "air" else ():
            ratio, z, away, codes = [], [], [], set()
            for trial in range(trials):
                rng = np.random.default_rng(trial)
                found = calibrated(cameras, rng, True, off)
                q = rng.uniform([-180, -180, -180], [180, 180, 100], (500, 3))
                b = np.array([project(c, q) for c in cameras]) + rng.normal(0, 0.1, (2, 500, 2))
                known = [c.uncertainty for c in found]
                surveys = [Survey(tuple(str(k) for k in range(64)), grid(), np.zeros(64), 0.1)] * 2
                joint = joint_covariance([c.camera for c in found], known, surveys)
                ours = locate_points([c.camera for c in found], b, sd=0.1, uncertainties=known, joint=joint)
                floor = np.linalg.norm(locate_points(cameras, b, sd=0.1).point - q, axis=-1).mean()
                ratio.append(np.linalg.norm(ours.point - q, axis=-1).mean() / floor)
                z.append((((ours.point - q) / ours.sigma) ** 2).mean())
                away.append(np.linalg.norm(found[0].camera.position - cameras[0].position))
                codes |= {f.code for c in found for f in c.findings if f.code.startswith("interface")}
            print(
                f"{name:8} {off:7.0f} {np.mean(ratio):19.3f} {np.sqrt(np.mean(z)):19.2f} {np.mean(away):14.1f}  "
                f"{', '.join(sorted(codes))}"
            )


WRONG: dict[str, dict[str, object]] = {
    "pane 5 sd thicker": {"thickness": (30 * 1.15,)},
    "pane twice as thick": {"thickness": (60.0,)},
    "pane of 1.515": {"indices": (1.0, 1.515, 1.333)},
    "pane of 1.6": {"indices": (1.0, 1.6, 1.333)},
    "water of 1.338": {"indices": (1.0, 1.49, 1.338)},
    "water of 1.36": {"indices": (1.0, 1.49, 1.36)},
}


def wrong(trials: int) -> None:
    """A window whose thickness or index is stated wrongly: what it costs, whether sigma covers it, what is found."""
    cameras, p = RIGS["window"], grid()
    for name, change in WRONG.items():
        ratio, z, codes = [], [], set()
        for trial in range(trials):
            rng = np.random.default_rng(trial)
            given = {"name": "window", "point": WINDOW.point, "normal": WINDOW.normal, "indices": WINDOW.indices}
            given |= {"thickness": WINDOW.thickness} | change
            done = []
            for camera in cameras:
                table = pd.DataFrame({"tag": [str(k) for k in range(len(p))], "sd_x": 0.1, "sd_y": 0.1})
                table[["x", "y", "z"]], table[["Xf", "Yf"]] = p, project(camera, p) + rng.normal(0, 0.1, (len(p), 2))
                lens = {"image_size": (640, 480), "sensor": (6.4, 4.8), "model": "tsai"}
                done.append(calibrate(table, through=[given], units="mm", search=False, **lens))
            q = rng.uniform([-180, -180, -180], [180, 180, 100], (500, 3))
            b = np.array([project(c, q) for c in cameras]) + rng.normal(0, 0.1, (2, 500, 2))
            known = [c.uncertainty for c in done]
            surveys = [Survey(tuple(str(k) for k in range(64)), p, np.zeros(64), 0.1)] * 2
            joint = joint_covariance([c.camera for c in done], known, surveys)
            ours = locate_points([c.camera for c in done], b, sd=0.1, uncertainties=known, joint=joint)
            floor = np.linalg.norm(locate_points(cameras, b, sd=0.1).point - q, axis=-1).mean()
            ratio.append(np.linalg.norm(ours.point - q, axis=-1).mean() / floor)
            z.append((((ours.point - q) / ours.sigma) ** 2).mean())
            codes |= {f.code for c in done for f in c.findings if f.code.startswith("interface")}
        scatter = np.sqrt(np.mean(z))
        print(
            f"{name:20} {np.mean(ratio):.3f} of the floor, scatter over sigma {scatter:.2f}  {', '.join(sorted(codes))}"
        )


def speed(n: int = 200_000, rounds: int = 5) -> None:
    q = np.random.default_rng(0).uniform([-180, -180, -180], [180, 180, 100], (n, 3))
    took: dict[str, list[float]] = {name: [] for name in RIGS}
    views = {name: np.array([project(c, q) for c in cameras]) for name, cameras in RIGS.items()}
    for _ in range(rounds):
        for name, cameras in RIGS.items():
            begun = time.process_time()
            locate_points(cameras, views[name], sd=0.1)
            took[name].append(time.process_time() - begun)
    air = min(took["air"])
    for name, times in took.items():
        print(f"{name:8} {n / min(times) / 1e3:7.0f} thousand points a second, {air / min(times):.2f} of air's")


def openptv() -> None:
    """Points from the rays of two cameras through a window, by OpenPTV (exact ray tracing) and by vidtrack."""
    from optv.calibration import Calibration as Theirs
    from optv.orientation import point_positions
    from optv.parameters import ControlParams

    pane = Interface("pane", np.array([0.0, 0, 130]), np.array([0.0, 0, 1]), (1.0, 1.49, 1.333), (20.0,))
    q = np.random.default_rng(0).uniform(-100, 90, (2000, 3))
    ours, theirs = [], []
    for x in (-300.0, 300.0):
        cal = Theirs()
        angle = np.arctan2(x, 1000.0)
        cal.set_pos(np.array([x, 50.0, 1000.0]))
        cal.set_angles(np.array([0.0, angle, 0.0]))
        cal.set_primary_point(np.array([0.0, 0.0, 50.0]))
        cal.set_glass_vec(np.array([0.0, 0.0, 110.0]))  # to the pane's side in the water
        theirs.append(cal)
        R = np.diag([1.0, -1, -1]) @ cal.get_rotation_matrix().T
        ours.append(Camera(0, 0, 1, 1, 1, 50.0, 0.0, R, -R @ cal.get_pos(), (100, 100), through=(pane,)))
    b = np.array([project(camera, q) for camera in ours])
    control = ControlParams(2)
    control.set_image_size((100, 100))
    control.set_pixel_size((1.0, 1.0))
    layers = control.get_multimedia_params()
    layers.set_n1(1.0)
    layers.set_layers([1.49], [20.0])
    layers.set_n3(1.333)
    metric = np.ascontiguousarray((b * np.array([1.0, -1.0])).transpose(1, 0, 2))
    point, _ = point_positions(metric, control, theirs, None)
    found = locate_points(ours, b, sd=0.1).point
    off = np.linalg.norm(point - found, axis=-1)
    print(
        f"OpenPTV and vidtrack, {len(q)} points: at most {off.max():.2e} mm apart, {off.max() / 1000:.1e} of the depth"
    )
    print(f"vidtrack and the truth: at most {np.linalg.norm(found - q, axis=-1).max():.2e} mm")


def real() -> None:
    """The public tank: 4 cameras, 1805 points. Its glass is not published: water is sought."""
    names = [REAL / f"cam{i}.csv" for i in range(4)]
    tables = [pd.read_csv(p, dtype={"tag": str}).rename(columns={"X": "Xf", "Y": "Yf"}) for p in names]
    p = tables[0][["x", "y", "z"]].to_numpy(float)
    b = np.stack([t[["Xf", "Yf"]].to_numpy(float) for t in tables])
    trials: list[tuple[str, str, list[dict[str, object]]]] = [("no interface", model, []) for model in ("tsai", "auto")]
    low, high = p.min(0), p.max(0)
    straight = [calibrate(t, image_size=(2560, 2160), model="tsai", search=False).camera for t in tables]
    ahead = np.mean([c.R[2] for c in straight], 0)
    axis = int(np.argmax(np.abs(ahead)))
    normal = np.eye(3)[axis] * np.sign(ahead[axis])
    near = (low if ahead[axis] > 0 else high) - 10 * normal
    wall = {"name": "wall", "point": near, "normal": normal, "indices": (1.0, 1.333)}
    loose = {"position": 20.0, "tilt": 3.0, "index": 0.002}
    trials += [("wall and water", model, [wall | {"sigma": loose}]) for model in ("tsai", "brown", "auto")]
    for name, model, through in trials:
        found = [
            calibrate(t, image_size=(2560, 2160), model=model, through=through, units="mm", search=False)
            for t in tables
        ]
        off = locate_points([c.camera for c in found], b).point - p
        rms = ", ".join(f"{c.record['rms_px']:.3f}" for c in found)
        used = sum(c.record["n_points"] for c in found)
        models = " ".join(c.record["model"] for c in found)
        print(f"{name:15} {model:6} {np.sqrt((off**2).sum(1).mean()):.4f} mm rms; {rms} px; {used} sights; {models}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("accuracy", "place", "wrong", "speed", "openptv", "real"))
    parser.add_argument("--trials", type=int, default=10)
    given = parser.parse_args()
    if given.what in ("accuracy", "place", "wrong"):
        {"accuracy": accuracy, "place": place, "wrong": wrong}[given.what](given.trials)
    else:
        {"speed": speed, "openptv": openptv, "real": real}[given.what]()


if __name__ == "__main__":
    main()
