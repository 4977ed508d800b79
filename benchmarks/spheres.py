"""Large and small balls before cameras with lenses: what their perspective does to positions, and what is left of it.

    python benchmarks/spheres.py tables --seed 1 --count 40
    python benchmarks/spheres.py films --seed 1 --count 4

tables: rigs of two or three cameras by kind (small calibration balls and a large float, the other way round, a large
range of distances, wide lenses, all balls alike). Centroids are those of exact outlines: the circle in which a cone of
sight touches the ball, seen through a pinhole and a radial lens, as a polygon. Each rig is calibrated and located by
the stages twice: without the sizes of balls, by which nothing is then corrected, and with them. Errors of positions, px
at their distance, the normalised error (rms), and samples with an empty flag that are off by more than 5 sigma and
0.05 px.
films: whole experiments with ray-cast balls, evenly lit, in H.264. Nothing here is shared with the code that corrects.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from scipy.ndimage import gaussian_filter

from vidtrack.errors import VidtrackError
from vidtrack.stages.calibrate import calibrate
from vidtrack.stages.locate import locate

WIDE, HIGH, FINE, RATE = 640, 480, 16, 30000 / 1001


class Eye:
    """A camera: where it stands, at what it looks, f in px, and kappa1 in 1/px^2 (Ru = Rd (1 + kappa1 Rd^2))."""

    def __init__(self, stands, at, f, kappa1, roll=0.0):
        ahead = np.array(at, float) - stands
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        down = np.cross(ahead, right)
        c, s = np.cos(roll), np.sin(roll)
        self.axes = np.array([c * right + s * down, c * down - s * right, ahead])
        self.stands, self.f, self.kappa1 = np.array(stands, float), f, kappa1
        self.middle = np.array([WIDE / 2 + 7.0, HIGH / 2 - 5.0])

    def sees(self, points):
        """Pixels (..., 2) of points (..., 3)."""
        p = (np.asarray(points) - self.stands) @ self.axes.T
        u = self.f * p[..., :2] / p[..., 2:]
        d = u.copy()
        for _ in range(60):
            d = u / (1 + self.kappa1 * (d * d).sum(-1, keepdims=True))
        return d + self.middle

    def rays(self, x, y):
        """Directions (..., 3) that pixels see."""
        d = np.stack([x - self.middle[0], y - self.middle[1]], -1)
        u = d * (1 + self.kappa1 * (d * d).sum(-1, keepdims=True)) / self.f
        ray = np.concatenate([u, np.ones((*u.shape[:-1], 1))], -1)
        return ray / np.linalg.norm(ray, axis=-1, keepdims=True) @ self.axes

    def outline(self, centre, radius, n=180):
        """The middle (..., 2) px and the area (...) px^2 of the outlines of balls at (..., 3)."""
        to = centre - self.stands
        D = np.linalg.norm(to, axis=-1, keepdims=True)
        d = to / D
        e1 = np.cross(d, self.axes[1])
        e1 /= np.linalg.norm(e1, axis=-1, keepdims=True)
        e2 = np.cross(d, e1)
        turn = 2 * np.pi * np.arange(n) / n
        r = np.broadcast_to(radius, D.shape[:-1])[..., None]
        near, wide = D - r * r / D, r * np.sqrt(1 - (r / D) ** 2)  # where the cone touches
        ring = np.cos(turn)[:, None] * e1[..., None, :] + np.sin(turn)[:, None] * e2[..., None, :]
        b = self.sees(self.stands + (near * d)[..., None, :] + wide[..., None] * ring)
        about = b.mean(-2, keepdims=True)
        x, y = np.moveaxis(b - about, -1, 0)
        xn, yn = np.roll(x, -1, -1), np.roll(y, -1, -1)
        cross = x * yn - xn * y
        area = cross.sum(-1) / 2
        middle = np.stack([((x + xn) * cross).sum(-1), ((y + yn) * cross).sum(-1)], -1) / (6 * area)[..., None]
        return middle + about[..., 0, :], np.abs(area)


KINDS = ("small, large", "large, small", "alike", "near and far", "wide, large", "wide, small")


def rig(kind, rng):
    """Cameras, points (n, 3), courses (m, k, 3) in the same volume, and the balls' radii in the clips and the run."""
    wide = kind.startswith("wide")
    f = rng.uniform(430, 520) if wide else rng.uniform(800, 1000)
    kappa1 = rng.uniform(2e-7, 8e-7) if wide else rng.uniform(-1e-7, 2.5e-7)
    reach = 135.0 if not wide else 75.0
    n = 2 if rng.random() < 0.7 else 3
    eyes = {}
    for i in range(n):
        turn = np.radians([-60, 30, -15][i] + rng.uniform(-10, 10))
        stands = reach * np.array([np.sin(turn), -np.cos(turn), 0]) + [0, 0, rng.uniform(20, 50)]
        at, own, roll = rng.uniform(-4, 4, 3), f * rng.uniform(0.97, 1.03), rng.uniform(-0.1, 0.1)
        eyes[f"cam{i + 1}"] = Eye(stands, at, own, kappa1, roll)
    points = np.array([(x, y, z) for y in (-24, 0, 24) for x in (-30, -10, 10, 30) for z in (20, 0, -20)], float)
    t = np.arange(60) / RATE
    along = [np.cos(2.5 * t + rng.uniform(0, 6)) for _ in range(6)]
    courses = np.stack([np.stack(along[:3], -1), np.stack(along[3:], -1)]) * (26, 20, 17)
    if kind == "near and far":
        points[:, 1] *= 2.2
        courses[..., 1] *= 2.2
    px = 135 / 900
    small, large = rng.uniform(3, 6) * px, rng.uniform(14, 22) * px
    if wide:
        small, large = small * 1.1, large * 1.1
    sizes = {"small": small, "large": large}
    words = kind.split(", ")
    before, after = {"alike": (large, large), "near and far": (small, large)}.get(kind, (sizes.get(words[0]), None))
    after = after or sizes[words[1]]
    return eyes, points, courses, before or (small if after == large else large), after


def measured(eye, p, radius, rng, noise, sized):
    """Columns Xf, Yf, sd_x, sd_y, and with sizes pixels and width, of balls at p (n, 3)."""
    b, area = eye.outline(p, radius)
    inside = ((b > 2) & (b < np.array([WIDE, HIGH]) - 2)).all(-1)
    b = np.where(inside[:, None], b + rng.normal(0, noise, b.shape), np.nan)
    out = {"Xf": b[:, 0], "Yf": b[:, 1], "sd_x": noise, "sd_y": noise}
    grown = rng.normal(1, 0.02, len(p))
    return out | ({"pixels": np.rint(area * grown), "width": 2 * np.sqrt(area / np.pi)} if sized else {})


def tried(kind, seed, number, sized, noise=0.01):
    """Errors (k, 3), sigmas, and px per unit of the located positions of one rig."""
    rng = np.random.default_rng([seed, KINDS.index(kind), number])
    eyes, points, courses, before, after = rig(kind, rng)
    cameras, tables, own_points = {}, {}, {}
    t = np.arange(courses.shape[1]) / RATE
    for name, eye in eyes.items():
        table = pd.DataFrame({"tag": np.arange(len(points)), **dict(zip("xyz", points.T, strict=True))})
        table = table.assign(sigma=1e-4, **measured(eye, points, before, rng, noise, sized))
        done = calibrate(table, image_size=(WIDE, HIGH), search=False, camera=name, model="auto", sigma=1e-4)
        cameras[name], own_points[name] = (done.camera, done.uncertainty), done.points
        parts = []
        for k, course in enumerate(courses):
            seen = measured(eye, course, after, rng, noise, sized)
            lost = np.isnan(seen["Xf"])
            parts.append(pd.DataFrame({"time_s": t, "target": f"t{k + 1}", **seen, "flag": np.where(lost, "lost", "")}))
        tables[name] = pd.concat(parts, ignore_index=True).drop(columns="width", errors="ignore")
    found = locate(tables, cameras, points=own_points, targets=["t1", "t2"], clocks={name: {} for name in eyes})
    table = found.trajectories
    place, plain = table[["x", "y", "z"]].to_numpy(), (table["flag"].fillna("") == "").to_numpy()
    moment = np.searchsorted(t, table["time_s"].to_numpy() - 1e-6)
    truth = np.stack([courses[int(str(name)[1:]) - 1][k] for name, k in zip(table["target"], moment, strict=True)])
    scale = np.mean([eye.f / np.linalg.norm(eye.stands) for eye in eyes.values()])
    sigma = table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()
    good = np.isfinite(place).all(-1)
    return (place - truth)[good], sigma[good], plain[good], scale


def tables(seed, count):
    """Rigs of each kind, without and with sizes."""
    for kind in KINDS:
        for sized in (False, True):
            errors, z, wrong, n = [], [], 0, 0
            for number in range(count):
                try:
                    error, sigma, plain, scale = tried(kind, seed, number, sized)
                except VidtrackError as refused:
                    print(f"{kind}, rig {number}: {refused}")
                    continue
                size = np.linalg.norm(error, axis=1)
                errors.append(size * scale)
                z.append(error / sigma)
                wrong += int((plain & (size > 5 * np.linalg.norm(sigma, axis=1)) & (size * scale > 0.05)).sum())
                n += int(plain.sum())
            off, ratio = np.concatenate(errors), np.concatenate(z)
            print(
                f"{kind:14} {'corrected' if sized else 'as it is ':9}  off {np.median(off):.3f} px, 95 % "
                f"{np.quantile(off, 0.95):.3f}, at most {off.max():.3f}; rms z {np.sqrt((ratio**2).mean()):.2f}, at "
                f"most {np.abs(ratio).max():.1f}; wrong {wrong} of {n}",
                flush=True,
            )


def picture(eye, balls, rng):
    """Grey levels (rows, columns) of evenly lit balls (centre, radius), the nearest in front."""
    out = np.full((HIGH, WIDE), 25.0)
    for centre, radius in sorted(balls, key=lambda one: -np.linalg.norm(one[0] - eye.stands)):
        at, area = eye.outline(np.asarray(centre, float), radius)
        if not np.isfinite(at).all():
            continue
        reach = 1.3 * np.sqrt(area / np.pi) + 3
        left, top = (int(np.clip(v - reach, 0, size)) for v, size in zip(at, (WIDE, HIGH), strict=True))
        right, bottom = (int(np.clip(v + reach + 2, 0, size)) for v, size in zip(at, (WIDE, HIGH), strict=True))
        if left >= right or top >= bottom:
            continue
        x = (np.arange((right - left) * FINE) + 0.5) / FINE + left - 0.5
        y = (np.arange((bottom - top) * FINE) + 0.5) / FINE + top - 0.5
        to = np.asarray(centre, float) - eye.stands
        along = eye.rays(*np.meshgrid(x, y)) @ to
        inside = (along > 0) & (along**2 > to @ to - radius**2)
        cover = inside.reshape(bottom - top, FINE, right - left, FINE).mean(axis=(1, 3))
        part = out[top:bottom, left:right]
        out[top:bottom, left:right] = part * (1 - cover) + 205 * cover
    out = gaussian_filter(out, 0.6) + rng.normal(0, 1.5, out.shape)
    return np.clip(np.rint(out), 0, 255).astype(np.uint8)


def film(path, pictures):
    """An H.264 recording with a time code."""
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{WIDE}x{HIGH}"]
    command += ["-r", "30000/1001", "-i", "-", "-c:v", "libx264", "-crf", "10", "-pix_fmt", "yuv420p"]
    with subprocess.Popen([*command, "-timecode", "10:00:00:00", str(path)], stdin=subprocess.PIPE) as writer:
        for one in pictures:
            writer.stdin.write(one.tobytes())


def experiment(folder, kind, rng):
    """An experiment folder without its truth, which is returned: courses (2, k, 3), the radii, px a unit."""
    eyes, points, courses, before, after = rig(kind, rng)
    points = points * (0.8, 1, 1) if kind != "near and far" else points * (0.8, 0.6, 1)
    courses = courses * 0.75 if kind != "near and far" else courses * (0.75, 0.5, 0.75)
    courses[0], courses[1] = courses[0] * (1, 1, 0.4) + (0, 0, 8), courses[1] * (1, 1, 0.4) - (0, 0, 8)
    clips = {f"y{k}": np.flatnonzero(points[:, 1] == y) for k, y in enumerate(sorted(set(points[:, 1])))}
    (folder / "runs" / "sway").mkdir(parents=True)
    (folder / "calibration").mkdir()
    table = pd.DataFrame(points, columns=["x", "y", "z"]).assign(sigma=0.001)
    table.insert(0, "tag", np.arange(1, len(points) + 1))
    table.to_csv(folder / "calibration" / "points.csv", index=False)
    for clip, tags in clips.items():
        (folder / "calibration" / clip).mkdir()
        picks = []
        for name, eye in eyes.items():
            at = eye.sees(points[tags]) + rng.normal(0, 1, (len(tags), 2))
            inside = ((at > 0) & (at < (WIDE - 1, HIGH - 1))).all(-1)
            picks += [(name, tag + 1, *np.round(b, 1)) for tag, b, ok in zip(tags, at, inside, strict=True) if ok]
            shown = [(points[tag], before) for tag in tags]
            film(folder / "calibration" / clip / f"{name}.mov", (picture(eye, shown, rng) for _ in range(6)))
        listed = pd.DataFrame(picks, columns=["camera", "tag", "Xf", "Yf"])
        listed.to_csv(folder / "calibration" / clip / "picks.csv", index=False)
    for name, eye in eyes.items():
        frames = ([(course[k], after) for course in courses] for k in range(courses.shape[1]))
        film(folder / "runs" / "sway" / f"{name}.mov", (picture(eye, shown, rng) for shown in frames))
    config = {
        "title": "large and small balls",
        "units": "in",
        "calibration": {"clips": {c: {"tags": ", ".join(str(t + 1) for t in tags)} for c, tags in clips.items()}},
        "cameras": {name: {} for name in eyes},
        "report": {"overlay": False},
        "runs": {"sway": {"targets": 2}},
    }
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    return courses, (before, after), np.mean([eye.f / np.linalg.norm(eye.stands) for eye in eyes.values()])


def films(seed, count):
    """Whole experiments, one kind after the other."""
    for number in range(count):
        kind, rng = KINDS[number % len(KINDS)], np.random.default_rng([seed, number])
        with tempfile.TemporaryDirectory() as where:
            folder = Path(where) / "spheres"
            folder.mkdir()
            courses, radii, scale = experiment(folder, kind, rng)
            command = [sys.executable, "-m", "vidtrack.command", "run", str(folder)]
            done = subprocess.run(command, capture_output=True, text=True)
            reached = folder / "results" / "runs" / "sway" / "trajectories.parquet"
            if not reached.exists():
                print(f"{number} {kind}: {(done.stdout + done.stderr).strip().splitlines()[-1]}", flush=True)
                continue
            verdict = json.loads((folder / "results" / "verdict.json").read_text())
            table = pd.read_parquet(reached)
        judged = [verdict["calibration"], *verdict["runs"].values()]
        reasons = ", ".join(sorted({one["code"] for own in judged for one in own["reasons"]}))
        for target, own in table.groupby("target"):
            place, moment = own[["x", "y", "z"]].to_numpy(), own["time_s"].to_numpy()
            step = np.rint((moment - moment.min()) * RATE).astype(int)
            errors = [place - course[step] for course in courses]
            error = min(errors, key=lambda one: np.nanmedian(np.abs(one)))
            size, sigma = np.linalg.norm(error, axis=1), own[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()
            plain = (own["flag"].fillna("") == "").to_numpy() & np.isfinite(size)
            wrong = plain & (size > 5 * np.linalg.norm(sigma, axis=1)) & (size * scale > 0.05)
            z = np.sqrt(np.nanmean((error[plain] / sigma[plain]) ** 2))
            how = f"{number} {kind} (radii {radii[0]:.2f}, {radii[1]:.2f} in) {target}"
            print(
                f"{how}: off {np.nanmedian(size) * scale:.3f} px, at most {np.nanmax(size[plain]) * scale:.3f}; "
                f"rms z {z:.2f}; wrong {wrong.sum()} of {plain.sum()}; {verdict['verdict']} ({reasons})",
                flush=True,
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("what", choices=["tables", "films"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=12)
    given = parser.parse_args()
    (tables if given.what == "tables" else films)(given.seed, given.count)


if __name__ == "__main__":
    main()
