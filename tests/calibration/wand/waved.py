"""A wand that is waved before the thesis's rig, as its cameras see it: what the tests of this room start from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.calibration.wand.measured import Views, Wand, wand_of
from vidtrack.calibration.wand.refined import refine_wand
from vidtrack.geometry.camera import Camera, contains, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import thesis_rig


class Scene(NamedTuple):
    cameras: list[Camera]
    nominal: list[Camera]  # what the config says of them
    wand: Wand
    t: np.ndarray
    ends: np.ndarray  # (n, q, 3)
    b: np.ndarray  # (m, n, q, 2)
    rng: np.random.Generator

    @property
    def views(self) -> Views:
        return Views(self.b, np.full(self.b.shape, 0.1), np.zeros(self.b.shape))


def path(rng, reach=14.0, turns=True):
    """A smooth motion: from times to middles (n, 3) and unit directions (n, 3)."""
    hz, phase = rng.uniform(0.1, 0.45, (2, 3, 3)), rng.uniform(0, 6.3, (2, 3, 3))

    def at(t):
        swings = np.sin(2 * np.pi * hz[..., None] * t + phase[..., None])
        middle = reach * swings[0].sum(0).T / 1.5
        along = (swings[1].sum(0) + 0.2).T if turns else np.tile([1.0, 0.3, 0.2], (len(t), 1))
        return middle, along / np.linalg.norm(along, axis=-1, keepdims=True)

    return at


def waved(
    seed,
    m=2,
    n=300,
    noise=0.1,
    lengths=None,
    reach=14.0,
    turns=True,
    bend=0.0,
    cameras=None,
    late=None,
    told=None,
    readout=0.0,
):
    """told: what is said of the lengths, if not what they are; late: s by which each camera's frames come later;
    readout: s, of the rows of every camera.
    """
    rng = np.random.default_rng(seed)
    cameras = cameras or thesis_rig(m)
    wand = wand_of(lengths or {"A-B": 20.0}, 0.002)
    move, t = path(rng, reach, turns), np.arange(n) / 30
    places = {2: (-0.5, 0.5), 3: (0.0, wand.lengths[0, 1], wand.lengths[0, -1])}[len(wand.ends)]
    places = np.array(places) * (wand.lengths[0, 1] if len(wand.ends) == 2 else 1.0)
    wobble = rng.normal(0, bend, n)

    def balls(at):
        middle, along = move(at)
        return middle[:, None] + along[:, None] * (places + wobble[:, None] * np.sign(places - 1e-9))[..., None]

    ends = balls(t)
    seen = [balls(t + (late[i] if late else 0.0)) for i in range(len(cameras))]
    b = np.stack([project(c, own) for c, own in zip(cameras, seen, strict=True)])
    for _ in range(4 if readout else 0):  # each ball when its row is read
        at = t[:, None] + readout * (b[..., 1] + 0.5) / cameras[0].image_size[1]
        own = [np.stack([balls(when[:, k])[:, k] for k in range(len(places))], 1) for when in at]
        b = np.stack([project(c, p) for c, p in zip(cameras, own, strict=True)])
    b = b + rng.normal(0, noise, b.shape)
    b = np.where(np.stack([contains(c, own) for c, own in zip(cameras, b, strict=True)])[..., None], b, np.nan)
    nominal = [
        c.with_(
            Cx=(c.image_size[0] - 1) / 2, Cy=(c.image_size[1] - 1) / 2, Sx=1.0, R=np.eye(3), T=np.zeros(3), f=20.0
        ).without_lens()
        for c in cameras
    ]
    return Scene(list(cameras), nominal, wand_of(told, 0.002) if told else wand, t, ends, b, rng)


def rigid_error(found, truth, rng, sd=0.1, n=400, reach=20.0):
    """Mean error of held-out points by cameras of unknown axes, and by the true ones: after the best rigid motion."""
    q = rng.uniform(-reach, reach, (n, 3))
    s = np.stack([project(c, q) for c in truth])
    s = s + rng.normal(0, sd, s.shape)
    floor = np.linalg.norm(locate_points(truth, s, sd=sd).point - q, axis=-1).mean()
    p = locate_points(found, s, sd=sd).point
    U, _, Vt = np.linalg.svd((q - q.mean(0)).T @ (p - p.mean(0)))
    R = (U * [1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return np.linalg.norm((p - p.mean(0)) @ R.T + q.mean(0) - q, axis=-1).mean(), floor


def refined(scene):
    """The wand's calibration of a scene, by Tsai's lens, from the true cameras in the first one's frame."""
    R, T = scene.cameras[0].R, scene.cameras[0].T
    start = [c.with_(R=c.R @ R.T, T=c.T - c.R @ R.T @ T) for c in scene.cameras]
    views = scene.views
    return refine_wand(start, lambda clocks: views, scene.wand, arrange=lambda v: v, models=("tsai",))
