"""Pictures that hold part of the picture before: their noise shows it, and what moves is seen late."""

from fractions import Fraction

import cv2
import numpy as np
import pytest

from tests.discs import picture as discs
from vidtrack.stages import track as stage
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.outlines.uneven_light import Ways
from vidtrack.tracking.pictures.mixed_pictures import MIXTURE, lateness_of_mixed, mixed_pictures
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.uncertainty.exposure_time import Exposure

SHAPE = (120, 160)


def samples(pictures, lines=1):
    return [Sample(np.clip(np.rint(p), 0, 255).astype(np.uint8), float(k), 0, lines) for k, p in enumerate(pictures)]


def noisy(n=12, sd=2.0, level=60.0, seed=0):
    rng = np.random.default_rng(seed)
    return [level + rng.normal(0, sd, SHAPE) for _ in range(n)]


def mixed(pictures, share):
    return [p if k == 0 else (1 - share) * p + share * pictures[k - 1] for k, p in enumerate(pictures)]


def recursive(pictures, share):
    out = [pictures[0]]
    for picture in pictures[1:]:
        out.append((1 - share) * picture + share * out[-1])
    return out


@pytest.mark.parametrize("share", [0.15, 0.3, 0.4])
def test_a_mixture_is_late_by_a_little_more_than_its_share(share):
    late = lateness_of_mixed(samples(mixed(noisy(), share)))
    assert share - 0.02 < late < share / (1 - share) + 0.1


@pytest.mark.parametrize("share", [0.2, 0.4])
def test_a_recursive_filter_is_late_by_its_sum(share):
    late = lateness_of_mixed(samples(recursive(noisy(30), share)[18:]))
    assert late == pytest.approx(share / (1 - share), rel=0.25)


def swinging(waves, slow=1.0):
    """What moves slowly everywhere: a grain that is shifted by a sine, with noise."""
    rng = np.random.default_rng(1)
    grain = cv2.GaussianBlur(rng.normal(0, 30, SHAPE), (0, 0), 2)
    shift = [waves * np.sin(k / 3 * slow) for k in range(12)]
    moved = [np.stack([np.interp(np.arange(SHAPE[1]) + s, np.arange(SHAPE[1]), row) for row in grain]) for s in shift]
    return [a + b for a, b in zip(noisy(), moved, strict=True)]


HEALTHY = {
    "noise": noisy(),
    "no noise": noisy(sd=0.0),
    "little noise": noisy(sd=0.3),
    "flicker": [p * (1 + 0.3 * np.sin(k)) for k, p in enumerate(noisy())],
    "exposure": [p * 1.05**k for k, p in enumerate(noisy())],
    "few": mixed(noisy(), 0.3)[: MIXTURE.fewest - 1],
    "sways": swinging(3.0),
    "shakes": swinging(1.0, slow=7.0),
}


@pytest.mark.parametrize("kind", list(HEALTHY))
def test_pictures_that_stand_for_themselves_are_not_late(kind):
    assert lateness_of_mixed(samples(HEALTHY[kind])) == 0


def test_a_lossy_coder_and_fields_are_not_judged():
    pictures = mixed(noisy(), 0.3)
    assert lateness_of_mixed(samples(pictures), copied=True) == 0
    assert lateness_of_mixed(samples(pictures)) > 0.2
    assert lateness_of_mixed(samples(pictures, lines=2)) == 0


COURSE = [(25 + 1.9 * k, 60 + 25 * np.sin(k / 9)) for k in range(40)]
SWINGS = [(65 + 30 * np.sin(k / 8), 60 + 25 * np.sin(k / 9)) for k in range(120)]


def film(share, how=mixed, where=COURSE):
    rng = np.random.default_rng(3)
    made = [discs(SHAPE, [(x, y, 6.0, 100.0)], level=40.0, noise=2.0, rng=rng, dtype=float) for x, y in where]
    frames = [Frame(k, Fraction(k, 25), one.luma, False, None) for k, one in enumerate(samples(how(made, share)))]
    found = track(frames, VideoInfo(SHAPE[1], SHAPE[0], Fraction(25), field_order="progressive"), targets=1)
    table = found.centroids
    assert (table["flag"] == "").all()
    error, sd = table[["Xf", "Yf"]].to_numpy() - where, table[["sd_x", "sd_y"]].to_numpy()
    wrong = ((np.abs(error) > 5 * sd) & (np.abs(error) > 0.1)).any(axis=1).sum()
    return int(wrong), sd, [one.code for one in found.findings]


def test_what_moves_in_mixed_pictures_is_late_by_no_more_than_its_sd_says(monkeypatch):
    wrong, sd, codes = film(0.25)
    assert (wrong, codes) == (0, ["pictures-mixed"])
    assert np.median(sd[:, 0]) < 1.2 * 1.9 * 0.4
    monkeypatch.setattr(Ways, "grown", lambda self, sd, own, place=None: sd)  # what is left is on one side
    assert film(0.25)[0] == 0
    monkeypatch.setattr(stage, "lateness_of_mixed", lambda *given, **more: 0.0)
    assert film(0.25)[0] > 20


def test_a_film_whose_pictures_stand_for_themselves_is_as_it_was(monkeypatch):
    before = film(0.0)
    assert before[2] == []
    monkeypatch.setattr(stage, "lateness_of_mixed", lambda *given, **more: 0.0)
    np.testing.assert_array_equal(film(0.0)[1], before[1])


def averaged(pictures, n):
    return [np.mean(pictures[max(k - n + 1, 0) : k + 1], axis=0) for k in range(len(pictures))]


def glowing(pictures, share):
    """A tube or a screen that glows on: of what was bright a share is left in the next picture."""
    out = [pictures[0]]
    for picture in pictures[1:]:
        out.append(np.maximum(picture, share * out[-1]))
    return out


def test_what_moves_in_pictures_that_glow_on_is_late_by_no_more_than_its_sd_says(monkeypatch):
    monkeypatch.setattr(stage, "lateness_of_mixed", lambda *given, **more: 0.0)
    wrong, _, codes = film(0.6, glowing, SWINGS)
    assert (wrong, codes) == (0, ["pictures-mixed"])


@pytest.mark.parametrize("n", [2, 3])
def test_what_moves_in_means_of_pictures_is_late_by_no_more_than_its_sd_says(n, monkeypatch):
    """Where a coder copies noise, the streaks alone show it."""
    monkeypatch.setattr(stage, "lateness_of_mixed", lambda *given, **more: 0.0)
    wrong, sd, codes = film(n, averaged, SWINGS)
    assert (wrong, codes) == (0, ["pictures-mixed"])
    assert np.median(sd[:, 0]) < 1.3 * 30 / 8 * (n - 1) / 2
    monkeypatch.setattr(Exposure, "late", 0.0)
    monkeypatch.setattr(stage, "lighting", lambda *given, **more: None)  # three balls in one, brighter on one side
    assert film(n, averaged, SWINGS)[0] > 60


def test_the_finding_says_by_how_much():
    assert mixed_pictures(0.0) == []
    assert "0.31 pictures late" in mixed_pictures(0.31)[0].text
    (drawn,) = mixed_pictures(1.04, 2.9)
    assert "over their way in 2.9 pictures" in drawn.text
    assert [one.level for one in (drawn, *mixed_pictures(0.1))] == ["doubtful", "note"]
