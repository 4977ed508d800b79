import cv2
import numpy as np
import pytest

from tests.shore.rendered_beach import ENDS, shore
from vidtrack.shore.transect import sampling_map, transect
from vidtrack.shore.waterline import water_edge


def stack_of(beach):
    line = transect(beach.camera, ENDS["from"], ENDS["to"])
    maps = sampling_map(line)
    grey = np.stack([cv2.remap(p, *maps, cv2.INTER_LINEAR).mean(1) for p in beach.pictures])
    return grey, np.interp(beach.edge, line.p[:, 0], np.arange(len(line.s)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "rms"),
    [
        ({"foam": False}, 0.5),
        ({"foam": True, "seed": 1, "noise": 4.0}, 1.0),
        ({"foam": True, "dark": False}, 0.7),
        ({"foam": False, "dark": False, "noise": 8.0}, 2.0),
    ],
)
def test_the_edge_is_within_a_px_or_two_of_the_truth(scene, rms):
    """A px is about 5 cm here. Ripples of 14 and sand of 8 grey levels; contrast 60 (dark), 45 (bright), 95 (foam)."""
    grey, truth = stack_of(shore(frames=50, **scene))
    edge = water_edge(grey)
    error = edge.position - truth
    assert 0.1 < np.sqrt((error**2).mean()) < rms
    assert abs(error.mean()) < 0.6
    assert not edge.at_end.any()
    assert not edge.faint.any()
    # honest but for bright ripples over bright sand, where the path itself may go wrong
    assert 0.2 < ((error / edge.sd) ** 2).mean() < (1.5 if scene.get("dark", True) or scene["foam"] else 8)


def step_stack(T=40, n=60, noise=2.0, wet=60, dry=150, seed=1):
    """A clean step that moves by parts of a sample, its samples integrated over their width."""
    rng = np.random.default_rng(seed)
    k = 30 + 12 * np.sin(np.arange(T) / 5)
    share = np.clip(k[:, None] - (np.arange(n) - 0.5), 0, 1)
    return dry + (wet - dry) * share + rng.normal(0, noise, (T, n)), k


@pytest.mark.parametrize(("wet", "dry"), [(60, 150), (150, 60)])
def test_a_clean_step_is_placed_between_samples(wet, dry):
    grey, k = step_stack(wet=wet, dry=dry)
    error = water_edge(grey).position - k
    assert error.std() < 0.12
    assert abs(error.mean()) < 0.1


def test_a_band_of_foam_before_dark_water_belongs_to_the_water():
    """Dark water and sand alone would put the edge behind the foam; but dry ground keeps to its grey level."""
    grey, k = step_stack()
    place = np.arange(60)
    band = (place < np.floor(k)[:, None] - 0.5) & (place > k[:, None] - 9)
    grey = np.where(band, 230 + np.random.default_rng(4).normal(0, 4, grey.shape), grey)
    grey = np.where(np.abs(place - k[:, None]) < 0.8, 190, grey)
    assert np.abs(water_edge(grey).position - k).max() < 1.5


def test_a_missing_frame_stays_missing():
    grey, k = step_stack()
    grey[7] = np.nan
    edge = water_edge(grey)
    assert np.isnan(edge.position[7])
    assert np.abs(np.delete(edge.position - k, 7)).max() < 0.5


def test_water_that_covers_everything_is_told():
    grey, _ = step_stack()
    grey[15:25] = np.random.default_rng(2).normal(60, 2, (10, 60))
    edge = water_edge(grey)
    assert edge.at_end.tolist() == [15 <= t < 25 for t in range(40)]
    assert edge.position[18] > 58


def test_ends_that_look_alike_are_refused():
    with pytest.raises(ValueError, match="look alike"):
        water_edge(np.random.default_rng(3).normal(100, 2, (30, 60)))


def test_too_few_frames_are_refused():
    with pytest.raises(ValueError, match="5 and 20 are needed"):
        water_edge(step_stack(T=4)[0])
