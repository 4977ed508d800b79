"""Targets that swing each in its own way, and the tracklets that cameras of the thesis's rig make of them."""

import numpy as np

from vidtrack.association.tracklets import pieces_of, tracklets_of
from vidtrack.geometry.camera import project

T = np.arange(150) / 30


def swarm(n, rng):
    """Places (n, 150, 3), in, of targets that swing about 5 s long, each in its own way."""
    middle = rng.uniform(-1, 1, (n, 1, 3)) * (28, 12, 12)
    reach = rng.uniform(2, 6, (n, 1, 3))
    return middle + reach * np.sin(rng.uniform(2, 5, (n, 1, 1)) * T[:, None] + rng.uniform(0, 6, (n, 1, 3)))


def seen(cameras, p, rng, noise=0.1):
    """Each camera's tracks (n, M, 2) px in an order of its own, and which target each is."""
    orders = [rng.permutation(len(p)) for _ in cameras]
    tracks = [
        project(c, p[o]) + rng.normal(0, noise, (len(p), p.shape[1], 2)) for c, o in zip(cameras, orders, strict=True)
    ]
    return tracks, orders


def as_tracklets(track, noise=0.1):
    """The tracklets of tracks (n, M, 2) that end at long gaps, and the track of each."""
    piece = pieces_of(track)
    row, moment = np.nonzero(piece >= 0)
    number, owner = np.unique(piece[row, moment], return_inverse=True)
    of = np.array([np.flatnonzero((piece == k).any(1))[0] for k in number], int)
    return tracklets_of(owner, moment, track[row, moment], np.full((row.size, 2), noise)), of


def who(association, tracks_of, orders):
    """For each trajectory the targets that its tracklets are of, with how many cameras show it."""
    out = []
    for k in range(association.m):
        own = [order[of[t == k]] for t, of, order in zip(association.trajectory, tracks_of, orders, strict=True)]
        out.append((set(np.concatenate(own).tolist()), sum(len(o) > 0 for o in own)))
    return out
