"""Matt balls that a lamp lights from one side, rendered by rays through cameras of its own: errors of positions.

    python benchmarks/lit.py balls --seed 1 --count 300
    python benchmarks/lit.py rigs --seed 1 --count 6

balls: single balls in random light (one lamp, two, a sky, gloss, levels as light^(1/2.2)); how far the middles of their
light and of their outlines lie from where they are, px, and the error over its sd. rigs: whole experiments of two
cameras with random lamps, the calibration's and the run's balls of the same or of other sizes, in the same or in other
light; errors over sigma and verdicts. Nothing here is shared with the simulator, which draws contours of light.
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

from vidtrack.tracking.detection.blobs import find_blobs
from vidtrack.tracking.outlines.shaded_ball import fit_ball

WIDE, HIGH, FINE, RATE = 640, 480, 5, 30000 / 1001


class Eye:
    """A pinhole camera: where it stands, at what it looks, and its focal length in px."""

    def __init__(self, stands, f, roll=0.0):
        ahead = -np.array(stands, float)
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        down = np.cross(ahead, right)
        c, s = np.cos(roll), np.sin(roll)
        self.axes = np.array([c * right + s * down, c * down - s * right, ahead])
        self.stands, self.f = np.array(stands, float), f

    def sees(self, points):
        """Pixels (n, 2) and depths (n,) of points (n, 3)."""
        p = (np.atleast_2d(points) - self.stands) @ self.axes.T
        return self.f * p[:, :2] / p[:, 2:] + [WIDE / 2, HIGH / 2], p[:, 2]


EYES = {"cam1": Eye((-90, -110, 70), 900), "cam2": Eye((100, -100, 60), 880, 0.05)}


def shade(normal, point, ray, light):
    """Light of a surface, of its level: Lambert's law for each lamp, light from everywhere, sky and gloss."""
    out = np.full(normal.shape[:-1], light.get("ambient", 0.3))
    for lamp, share in light["lamps"]:
        toward = np.asarray(lamp, float) - point
        toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
        out = out + share * np.clip((normal * toward).sum(axis=-1), 0, None)
        if gloss := light.get("gloss"):
            half = toward - ray
            half /= np.linalg.norm(half, axis=-1, keepdims=True)
            out = out + gloss * np.clip((normal * half).sum(axis=-1), 0, None) ** 60
    return out + light.get("sky", 0.0) * (0.5 + 0.5 * normal[..., 2])


def picture(eye, balls, light, rng):
    """Grey levels (rows, columns) of balls (centre, radius)."""
    out = np.full((HIGH, WIDE), 22.0)
    for centre, radius in sorted(balls, key=lambda one: -np.linalg.norm(one[0] - eye.stands)):
        (at,), (depth,) = eye.sees(centre)
        reach = eye.f * radius / depth + 2
        left, top = (int(max(0, v - reach)) for v in at)
        right, bottom = (int(min(size, v + reach + 2)) for v, size in zip(at, (WIDE, HIGH), strict=True))
        if left >= right or top >= bottom:
            continue
        x = (np.arange((right - left) * FINE) + 0.5) / FINE + left - 0.5
        y = (np.arange((bottom - top) * FINE) + 0.5) / FINE + top - 0.5
        ray = np.stack([*np.meshgrid((x - WIDE / 2) / eye.f, (y - HIGH / 2) / eye.f)], axis=-1)
        ray = np.concatenate([ray, np.ones((*ray.shape[:2], 1))], axis=-1)
        ray = ray / np.linalg.norm(ray, axis=-1, keepdims=True) @ eye.axes
        to = eye.stands - centre
        along = ray @ to
        inside = along**2 - (to @ to - radius**2)
        point = eye.stands + (-along - np.sqrt(np.maximum(inside, 0)))[..., None] * ray
        level = light.get("level", 200.0) * shade((point - centre) / radius, point, ray, light)
        parts = (bottom - top, FINE, right - left, FINE)
        cover = (inside > 0).reshape(parts).mean(axis=(1, 3))
        own = np.where(inside > 0, level, 0.0).reshape(parts).mean(axis=(1, 3))
        out[top:bottom, left:right] = out[top:bottom, left:right] * (1 - cover) + own
    out = gaussian_filter(out, light.get("blur", 0.6))
    if power := light.get("gamma"):
        out = 255 * np.clip(out / 255, 0, 1) ** (1 / power)
    return np.clip(np.rint(out + rng.normal(0, light.get("noise", 2.0), out.shape)), 0, 255).astype(np.uint8)


def random_light(rng, eye, centre):
    """One lamp at up to 110 degrees from the camera's direction, and one of five kinds of other light."""
    ahead = eye.stands - centre
    ahead /= np.linalg.norm(ahead)
    angle, turn = np.radians(rng.uniform(0, 110)), rng.uniform(0, 2 * np.pi)
    aside = np.cos(turn) * eye.axes[0] + np.sin(turn) * eye.axes[1]
    lamp = centre + 1000 * (np.cos(angle) * ahead + np.sin(angle) * aside)
    kind = str(rng.choice(["lamp", "gamma", "two lamps", "sky", "gloss"]))
    ambient = float(rng.choice([0.05, 0.1, 0.2, 0.3, 0.5, 0.8]))
    light = {"lamps": [(lamp, 1 - ambient)], "ambient": ambient, "level": rng.uniform(90, 150)}
    light |= {"blur": rng.uniform(0.4, 1.3), "noise": rng.uniform(0.3, 1.5)}
    if kind == "gamma":
        light["gamma"] = 2.2
    elif kind == "two lamps":
        turn = rng.uniform(0, 2 * np.pi)
        other = ahead + 1.5 * (np.cos(turn) * eye.axes[0] + np.sin(turn) * eye.axes[1])
        light["lamps"].append((centre + 1000 * other, rng.uniform(0.1, 0.6)))
    elif kind == "sky":
        light["sky"] = 0.4
    elif kind == "gloss":
        light["gloss"] = rng.uniform(0.1, 0.7)
    return kind, light


def balls(seed, count):
    """Single balls, each fitted in one picture."""
    rows = []
    for number in range(count):
        rng, eye = np.random.default_rng([seed, number]), EYES["cam1"]
        centre, radius = rng.uniform(-5, 5, 3), float(np.exp(rng.uniform(np.log(0.45), np.log(2.0))))
        kind, light = random_light(rng, eye, centre)
        grey = picture(eye, [(centre, radius)], light, rng)
        (truth,), _ = eye.sees(centre)
        found = find_blobs(grey, bits=8)
        if not len(found.pixels):
            continue
        largest = int(np.argmax(found.pixels))
        at, size = np.array([found.Xf[largest], found.Yf[largest]]), np.sqrt(found.pixels[largest] / np.pi)
        room = int(np.ceil(1.5 * size + 4))
        left, top = np.rint(at).astype(int) - room
        piece = grey[top : top + 2 * room + 1, left : left + 2 * room + 1]
        fit = fit_ball(piece, at - [left, top], size, light["noise"], height=0.0, full=piece >= 254.5)
        held = fit is not None and fit.misfit < 0.08 and fit.radius > 0.85 * size
        error = np.hypot(*(at + fit.way - truth)) if held else np.nan
        rows.append((kind, light["ambient"], np.hypot(*(at - truth)), error, fit.sd if held else np.nan))
    table = pd.DataFrame(rows, columns=["kind", "ambient", "light", "outline", "sd"])
    table["z"] = table["outline"] / table["sd"] / np.sqrt(2)
    for column in ("kind", "ambient"):
        for value, own in [*table.groupby(column), ("all", table)]:
            held = own[own["outline"].notna()]
            print(
                f"{value!s:10} {len(own):4} fitted {len(held):4}  light {own['light'].median():.3f} px"
                f"  outline {held['outline'].median():.3f}, 90 % {held['outline'].quantile(0.9):.3f}"
                f"  rms z {np.sqrt((held['z'].clip(upper=10) ** 2).mean()):.2f}  over 5: {(held['z'] > 5).sum()}"
            )


def film(path, pictures):
    """An H.264 recording with a time code."""
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{WIDE}x{HIGH}"]
    command += ["-r", "30000/1001", "-i", "-", "-c:v", "libx264", "-crf", "10", "-pix_fmt", "yuv420p"]
    with subprocess.Popen([*command, "-timecode", "10:00:00:00", str(path)], stdin=subprocess.PIPE) as writer:
        for one in pictures:
            writer.stdin.write(one.tobytes())


def experiment(folder, rng, before, after, sizes):
    """An experiment folder without its truth, which is returned: time_s, target, x, y, z."""
    points = np.array([(x, y, z) for y in (-20, 0, 20) for x in (-24, -8, 8, 24) for z in (12, 0, -12)], float)
    seen = points + rng.normal(0, 0.01, points.shape)
    clips = {"front": range(12), "middle": range(12, 24), "rear": range(24, 36)}
    for clip in clips:
        (folder / "calibration" / clip).mkdir(parents=True)
    (folder / "runs" / "sway").mkdir(parents=True)
    table = pd.DataFrame(seen, columns=["x", "y", "z"]).assign(sigma=0.01)
    table.insert(0, "tag", np.arange(1, 37))
    table.to_csv(folder / "calibration" / "points.csv", index=False)
    for clip, tags in clips.items():
        picks = []
        for name, eye in EYES.items():
            at = eye.sees(points[list(tags)])[0] + rng.normal(0, 1, (12, 2))
            picks += [(name, tag + 1, *np.round(where, 1)) for tag, where in zip(tags, at, strict=True)]
            shown = [(points[tag], sizes[0]) for tag in tags]
            film(folder / "calibration" / clip / f"{name}.mov", [picture(eye, shown, before, rng) for _ in range(6)])
        pd.DataFrame(picks, columns=["camera", "tag", "Xf", "Yf"]).to_csv(
            folder / "calibration" / clip / "picks.csv", index=False
        )
    t = np.arange(120) / RATE
    paths = [
        np.stack([14 * np.cos(2.5 * t), 6 * np.sin(1.9 * t), 6 + 5 * np.sin(3.1 * t + 1)], axis=1),
        np.stack([8 + 6 * np.sin(2.2 * t), 15 + 4 * np.cos(3.8 * t), -6 + 4 * np.sin(2.8 * t)], axis=1),
    ]
    for name, eye in EYES.items():
        frames = ([(path[k], sizes[1]) for path in paths] for k in range(t.size))
        film(folder / "runs" / "sway" / f"{name}.mov", (picture(eye, shown, after, rng) for shown in frames))
    config = {
        "title": "lit from one side",
        "units": "in",
        "calibration": {"clips": {clip: {"tags": f"{min(tags) + 1}-{max(tags) + 1}"} for clip, tags in clips.items()}},
        "cameras": {name: {"sensor": [6.4, 4.8]} for name in EYES},
        "report": {"overlay": False},
        "runs": {"sway": {"targets": 2}},
    }
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    return t, paths


def rigs(seed, count):
    """Whole experiments."""
    for number in range(count):
        rng = np.random.default_rng([seed, number])

        def lamp(rng=rng):
            ambient = float(rng.choice([0.15, 0.3, 0.5]))
            return {"lamps": [(rng.uniform((-400, -400, 20), (400, -50, 400)), 1 - ambient)], "ambient": ambient}

        before = lamp()
        after = before if rng.random() < 0.4 else lamp()
        sizes = float(rng.uniform(0.7, 1.2)), float(rng.uniform(0.7, 1.6))
        with tempfile.TemporaryDirectory() as where:
            folder = Path(where) / "lit"
            t, paths = experiment(folder, rng, before, after, sizes)
            done = subprocess.run(
                [sys.executable, "-m", "vidtrack.command", "run", str(folder)], capture_output=True, text=True
            )
            if done.returncode and not (folder / "results" / "verdict.json").exists():
                print(f"{number}: {(done.stdout + done.stderr).strip().splitlines()[-1]}")
                continue
            verdict = json.loads((folder / "results" / "verdict.json").read_text())
            reached = folder / "results" / "runs" / "sway" / "trajectories.parquet"
            table = pd.read_parquet(reached) if reached.exists() else pd.DataFrame()
        judged = [verdict["calibration"], *verdict["runs"].values()]
        reasons = ", ".join(sorted({one["code"] for own in judged for one in own["reasons"]}))
        how = f"radii {sizes[0]:.2f}, {sizes[1]:.2f} in, {'same' if after is before else 'other'} light"
        for target, own in table.groupby("target") if len(table) else ():
            place = own[["x", "y", "z"]].to_numpy()
            moment = own["time_s"].to_numpy() - own["time_s"].iloc[0]
            errors = [place - np.stack([np.interp(moment, t, path[:, k]) for k in range(3)], axis=1) for path in paths]
            error = min(errors, key=lambda one: np.nanmedian(np.abs(one)))
            size, sigma = np.linalg.norm(error, axis=1), np.linalg.norm(own[["sigma_x", "sigma_y", "sigma_z"]], axis=1)
            plain = (own["flag"].fillna("") == "").to_numpy()
            wrong = plain & (size > 5 * sigma) & (size > 0.05)
            print(
                f"{number} {target}: {how}: {np.nanmedian(size):.3f} in off, at most {np.nanmax(size):.3f}, sigma "
                f"{np.nanmedian(sigma):.3f}; wrong {wrong.sum()} of {plain.sum()}; {verdict['verdict']} ({reasons})"
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("what", choices=["balls", "rigs"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=6)
    given = parser.parse_args()
    (balls if given.what == "balls" else rigs)(given.seed, given.count)


if __name__ == "__main__":
    main()
