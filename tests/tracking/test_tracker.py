"""Following drawn targets through drawn pictures: what is found, what is not, and that nothing is made up."""

import cv2
import numpy as np
import pytest

from tests.discs import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import no_blobs
from vidtrack.tracking.initiation.initialisation import clutter_besides, find_targets
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import CORRUPT, EDGE, FLAGS, LOST, MERGED, PREDICTED, RECOVERED, Starts, present
from vidtrack.tracking.tracker import Tracker

SHAPE = (200, 300)
DETECTION = Detection(noise=2.0)


def samples_of(paths, *, radius=4.0, noise=2.0, still=(), shape=SHAPE, level=30.0, contrast=180.0, light=None):
    """One picture a sample of targets on paths (k, n, 2); NaN hides a target; `still` (x, y, radius) stands about."""
    rng = np.random.default_rng(0)
    samples = []
    for k, at in enumerate(paths):
        gain = 1.0 if light is None else light[k]
        balls = [(*p, radius, contrast * gain) for p in at if np.isfinite(p).all()]
        balls += [(*p, contrast * gain) for p in still]
        samples.append(Sample(picture(shape, balls, level=level * gain, noise=noise, rng=rng), float(k)))
    return samples


def starts_at(position, box=50.0):
    position = np.asarray(position, float)
    n = len(position)
    unknown, pair = np.full(n, np.nan), np.full((n, 2), np.nan)
    return Starts(
        position, pair, pair.copy(), np.full((n, 2), box), np.zeros(n, int), unknown, unknown, unknown, pair.copy()
    )


def followed(samples, starts, *, clutter=None, detection=DETECTION, **settings):
    tracker = Tracker(starts, detection, 100.0, clutter=clutter, **settings)
    tracker.follow(samples)
    tracker.finish()
    rows = tracker.rows()
    assert rows.flag.shape[0] == len(samples)
    # the law of the house: a guess is never a measurement
    assert not (present(rows) & (rows.flag & (LOST | PREDICTED) > 0)).any()
    assert (present(rows) | (rows.flag > 0)).all()
    return rows, tracker


def circle(k, n=1, radius=60.0, period=60.0):
    t = 2 * np.pi * (np.arange(k)[:, None] / period + np.arange(n) / n)
    return np.stack([150 + radius * np.cos(t), 100 + radius * np.sin(t)], axis=-1)


def positions(rows):
    return rows.values[:2].transpose(1, 2, 0)


def test_targets_are_followed_to_a_hundredth_of_a_pixel():
    path = circle(80, 3)
    rows, _ = followed(samples_of(path), starts_at(path[0]))
    error = positions(rows) - path
    assert present(rows).all()
    assert (rows.flag == 0).all()
    assert np.sqrt(np.mean(error**2)) < 0.010
    assert np.sqrt(np.mean(error**2)) > 0.003


@pytest.mark.parametrize(("radius", "least", "most"), [(4.0, 0.006, 0.010), (1.6, 0.005, 0.03)])
def test_long_tracks_keep_the_accuracy_of_the_centroids(radius, least, most):
    """Contrast 200, noise 3; the mask follows from what a look found of the soft edge."""
    path = circle(400, 3, period=37.3)
    samples = samples_of(path, radius=radius, contrast=200.0, noise=3.0)
    rows, tracker = followed(samples, starts_at(path[0]), detection=Detection(noise=3.0))
    error = positions(rows) - path
    assert present(rows).mean() > 0.97  # seven pixels more or less: now and then fewer than four
    rms = np.sqrt(np.nanmean(error**2, axis=(0, 1)))
    assert (rms > least).all()
    assert (rms < most).all()
    assert np.nanmax(np.abs(error)) < 6 * most
    assert (tracker.state.appearance.soft > 1).all()


def test_the_box_is_about_the_target():
    path = circle(40)
    rows, _ = followed(samples_of(path), starts_at(path[0]))
    assert np.abs(rows.corner + 25 - path).max() < 0.1


def test_crossing_targets_keep_their_identity():
    """Head on at 6 px a sample: they are one blob for three samples, in which neither is measured."""
    t = np.arange(60.0)
    path = np.stack([np.stack([60 + 3 * t, 100 + 0.1 * t], -1), np.stack([240 - 3 * t, 104 - 0.1 * t], -1)], axis=1)
    rows, _ = followed(samples_of(path), starts_at(path[0]))
    error = np.abs(positions(rows) - path)
    assert np.nanmax(error) < 0.15
    lost = ~present(rows)
    assert 1 <= lost.sum(axis=0).max() <= 5
    assert (rows.flag[lost] & (MERGED | LOST) > 0).all()
    assert rows.flag[lost][0] & MERGED
    assert present(rows)[-20:].all()


def test_a_target_behind_a_post_is_lost_then_recovered():
    path = circle(60)
    hidden = path.copy()
    hidden[20:27] = np.nan
    rows, _ = followed(samples_of(hidden), starts_at(path[0]))
    assert not present(rows)[20:27].any()
    assert (rows.flag[20:27] == LOST | PREDICTED).all()
    assert rows.flag[27, 0] == RECOVERED
    assert present(rows)[28:].all()
    assert np.nanmax(np.abs(positions(rows) - path)) < 0.1


def test_a_target_that_leaves_the_picture_and_comes_back_is_found_again():
    t = np.arange(120.0)
    path = np.stack([150 + 190 * np.sin(2 * np.pi * t / 100), 100 + 0.2 * t], -1)[:, None]
    rows, _ = followed(samples_of(path), starts_at(path[0]))
    inside = (path[:, 0, 0] > 6) & (path[:, 0, 0] < 293)
    assert not present(rows)[~inside].any()
    assert present(rows)[inside].mean() > 0.85
    assert (rows.flag & EDGE > 0).any()
    assert (rows.flag & RECOVERED > 0).any()
    assert np.nanmax(np.abs(positions(rows) - path)) < 0.2


def test_bright_things_that_stand_about_do_not_capture_a_target():
    """The target goes past a lamp of its own size and is hidden right beside it for a while."""
    t = np.arange(50.0)
    path = np.stack([60 + 3 * t, np.full(50, 92.0)], -1)[:, None]
    still = [(130.0, 104.0, 4.0), (200.0, 80.0, 4.0)]
    hidden = path.copy()
    hidden[22:30] = np.nan
    samples = samples_of(hidden, still=still)
    clutter = clutter_besides(samples, path[0], np.array([[50.0, 50.0]]), DETECTION)
    assert clutter.Xf.size == 2
    rows, _ = followed(samples, starts_at(path[0]), clutter=clutter)
    assert np.nanmax(np.abs(positions(rows) - path)) < 0.2
    assert present(rows)[[*range(20), *range(34, 50)]].mean() > 0.9


def test_slow_changes_of_light_are_followed():
    """The light falls to a third: a threshold fixed at the start (120) would lose the target (90)."""
    path = circle(120)
    light = np.linspace(1.0, 0.35, 120)
    rows, tracker = followed(samples_of(path, light=light), starts_at(path[0]))
    assert present(rows).all()
    assert rows.values[4].std() / rows.values[4].mean() < 0.05
    assert tracker.levels(np.array([0]))[0] == pytest.approx(0.35 * (30 + 90), rel=0.15)


@pytest.mark.parametrize("contrast", [120.0, 200.0])
def test_the_threshold_of_a_tiny_blurred_target_does_not_run_away(contrast):
    """Half-way up lies the level at 30 + contrast/2; the more of a Gaussian falls below it, the fewer pixels are left
    to share its light: half of that mean is above any level of it.
    """
    path = circle(150, 3, radius=50.0)
    samples = [
        sample._replace(luma=cv2.GaussianBlur(sample.luma, (0, 0), 0.6))
        for sample in samples_of(path, radius=1.5, contrast=contrast, noise=4.0)
    ]
    rows, tracker = followed(samples, starts_at(path[0]))
    assert present(rows).all()
    level = (tracker.levels(np.arange(3)) - 30) / contrast
    assert ((level > 0.25) & (level < 0.5)).all()
    assert np.sqrt(np.mean((positions(rows) - path) ** 2)) < 10.0 / contrast  # noise 4, joined by the blur


@pytest.mark.parametrize(("radius", "least"), [(2.5, 0.98), (4.0, 1.0), (15.0, 1.0)])
def test_dim_targets_in_much_noise_are_followed(radius, least):
    """Six sigmas above the background, where the level for lone pixels lies: half of their pixels are below it."""
    path = circle(30, 3)
    samples = samples_of(path, radius=radius, contrast=60.0, noise=10.0)
    tracker = Tracker(starts_at(path[0], box=2 * radius + 30), Detection(noise=10.0), 90.0)
    tracker.follow(samples)
    tracker.finish()
    rows = tracker.rows()
    error = positions(rows) - path
    z = error / rows.values[2:4].transpose(1, 2, 0)
    assert present(rows).mean() >= least
    assert np.nanmax(np.abs(error)) < 1
    assert 0.8 < np.sqrt(np.nanmean(z**2)) < 1.2


def test_a_threshold_by_hand_stays():
    path = circle(60)
    light = np.linspace(1.0, 0.35, 60)
    rows, tracker = followed(
        samples_of(path, light=light), starts_at(path[0]), detection=Detection(noise=2.0, threshold=140.0)
    )
    assert not present(rows)[-10:].any()
    assert tracker.levels(np.array([0]))[0] == 140


def test_damaged_pictures_are_no_measurements():
    path = circle(30)
    samples = [s._replace(corrupt=k in (10, 11)) for k, s in enumerate(samples_of(path))]
    rows, _ = followed(samples, starts_at(path[0]))
    assert (rows.flag[10:12] == CORRUPT | PREDICTED).all()
    assert not present(rows)[10:12].any()
    assert present(rows)[12:].all()


def test_a_jump_out_of_the_box_is_bridged_by_the_whole_picture():
    path = np.concatenate([circle(20), circle(20) + np.array([40, 0])])
    path[20:, 0] = 300 - path[20:, 0]
    rows, _ = followed(samples_of(path), starts_at(path[0]))
    assert present(rows)[-5:].all()
    assert np.nanmax(np.abs(positions(rows) - path)) < 0.2
    assert 1 <= (rows.flag & RECOVERED > 0).sum() <= 2


def test_nothing_in_the_box_is_nothing():
    rows, _ = followed(samples_of(np.full((20, 1, 2), np.nan)), starts_at([[100.0, 100.0]]))
    assert not present(rows).any()
    assert (rows.flag & LOST > 0).all()


def test_reading_in_batches_of_any_size_gives_the_same():
    path = circle(50, 2)
    samples = samples_of(path)
    whole, _ = followed(samples, starts_at(path[0]))
    pieces = Tracker(starts_at(path[0]), DETECTION, 100.0)
    for k in range(0, 50, 7):
        pieces.follow(samples[k : k + 7])
    pieces.finish()
    assert np.array_equal(pieces.rows().values, whole.values, equal_nan=True)


def test_total_pixels_are_those_of_the_whole_picture():
    path = circle(20, 4)
    samples = samples_of(path)
    rows, _ = followed(samples, starts_at(path[:1, 0][0:1]))
    assert rows.total_pixels.tolist() == [(s.luma > 100).sum() for s in samples]
    dark = [s._replace(luma=255 - s.luma) for s in samples]
    rows, _ = followed(dark, starts_at(path[0]), detection=Detection(noise=2.0, dark=True))
    assert rows.total_pixels.tolist() == [(s.luma < 155).sum() for s in dark]
    assert present(rows).all()


def test_targets_are_found_by_their_motion_in_a_fixed_order():
    path = circle(30, 4, radius=50.0)
    samples = samples_of(path, still=[(30.0, 30.0, 8.0), (270.0, 170.0, 8.0)])
    opening = find_targets(samples, 4, DETECTION)
    assert opening.moving == 4
    begin = np.array([trail.position[0] for trail in opening.trails])
    order = np.lexsort((path[0, :, 0].round(), path[0, :, 1].round()))
    assert np.abs(begin - path[0, order]).max() < 0.7
    assert opening.clutter.Xf == pytest.approx([30, 270], abs=0.2)


def test_a_target_that_creeps_over_its_own_ghost_is_found_from_the_first_sample_and_named_in_its_turn():
    fast = circle(24, 10, radius=70.0)
    slow = np.stack([150.0 + 0.15 * np.arange(24), np.full(24, 95.0)], axis=-1)[:, None]
    samples = samples_of(np.concatenate([fast, slow], axis=1), still=[(30.0, 30.0, 4.0)])
    opening = find_targets(samples, 11, DETECTION)
    assert opening.moving == 11
    begin = np.array([trail.position[0] for trail in opening.trails])
    assert {int(trail.sample[0]) for trail in opening.trails} == {0}
    assert np.hypot(*(begin - slow[0]).T).min() < 0.7
    assert (np.diff(begin[:, 1].round()) >= 0).all()
    assert opening.clutter.Xf == pytest.approx([30], abs=0.2)


def test_without_motion_the_bright_compact_blobs_are_taken():
    stick = [(30.0 + 3 * i, 30.0, 4.0) for i in range(20)]
    path = np.tile([[[150.0, 100.0], [80.0, 150.0]]], (10, 1, 1))
    opening = find_targets(samples_of(path, still=stick), 2, DETECTION)
    assert opening.moving == 0
    assert np.array([t.position[0] for t in opening.trails]) == pytest.approx(path[0], abs=0.3)
    assert opening.clutter.Xf.size == 1


def test_an_empty_picture_has_no_targets():
    opening = find_targets(samples_of(np.full((8, 1, 2), np.nan)), 3, DETECTION)
    assert opening.trails == []
    assert opening.clutter.Xf.size == no_blobs().Xf.size == 0


def test_every_flag_has_its_word():
    assert len(FLAGS) == 9
    assert FLAGS[(MERGED).bit_length() - 1] == "merged"
    assert FLAGS[(CORRUPT).bit_length() - 1] == "corrupt"


def test_the_first_look_corrects_a_size_that_motion_alone_has_told():
    """A slow target's own place in the background hides part of it: too low a mask would cut its centroid."""
    path = np.stack([100 + 0.3 * np.arange(30.0), 80 + 0.9 * np.arange(30.0)], -1)[:, None]
    rough = starts_at(path[0])._replace(
        velocity=np.array([[0.3, 0.9]]),
        acceleration=np.zeros((1, 2)),
        pixels=np.array([60.0]),
        contrast=np.array([175.0]),
        size=np.array([[9.0, 5.0]]),
    )
    rows, tracker = followed(samples_of(path), rough)
    assert tracker.state.appearance.size[1, 0] == pytest.approx(9, abs=1.1)
    assert np.nanmax(np.abs(positions(rows) - path)) < 0.05
