import numpy as np

from tests.discs import picture
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.detection.unexplained import WholePicture
from vidtrack.tracking.sample import Sample

SHAPE = (80, 120)
DETECTION = Detection(noise=2.0)
NOT_ESTIMATED = np.zeros((0, 2))


def sample(*balls, seed=0):
    rng = np.random.default_rng(seed)
    return Sample(picture(SHAPE, [(*at, 4.0) for at in balls], level=30, contrast=120, noise=2, rng=rng), 0.0)


def background(*balls):
    return {0: picture(SHAPE, [(*at, 4.0) for at in balls], level=30, contrast=120)}


def test_what_is_neither_background_nor_a_target_is_a_candidate():
    whole = WholePicture(background((20, 20)), DETECTION, None)
    found = whole.candidates(
        sample((20, 20), (60, 40), (100, 60)), np.array([[60.0, 40.0]]), np.full((1, 2), 9.0), 100.0
    )
    assert found.Xf.round().tolist() == [100]
    assert found.Yf.round().tolist() == [60]


def test_noise_alone_gives_no_candidate():
    whole = WholePicture(background(), DETECTION, None)
    assert all(whole.candidates(sample(seed=k), NOT_ESTIMATED, NOT_ESTIMATED, np.nan).Xf.size == 0 for k in range(20))


def test_what_has_left_its_place_is_background_no_more_and_no_clutter():
    mask = (background((20, 20))[0] > 90).astype(np.uint8)
    sums = np.pad(mask.cumsum(0).cumsum(1), ((1, 0), (1, 0))).astype(np.int32)
    whole = WholePicture(background((20, 20)), DETECTION, StaticClutter({0: sums}))
    x, y = np.array([[20.0]]), np.array([[20.0]])
    assert whole.static.touched([sample()], x, y, 5.0, 5.0).all()
    whole.candidates(sample(), NOT_ESTIMATED, NOT_ESTIMATED, 100.0)
    assert not whole.static.touched([sample()], x, y, 5.0, 5.0).any()
    back = whole.candidates(sample((20, 20)), NOT_ESTIMATED, NOT_ESTIMATED, 100.0)
    assert back.Xf.round().tolist() == [20]


def clutter(mask):
    sums = np.pad(mask.astype(np.uint8).cumsum(0).cumsum(1), ((1, 0), (1, 0))).astype(np.int32)
    return StaticClutter({0: sums})


def test_of_what_has_moved_by_a_part_of_its_size_nothing_stands_there():
    """Two large balls that overlap leave a ghost in the background; they have gone on by a fifth of it."""
    shape = 200, 300
    ghost = np.maximum(*(picture(shape, [(x, 40, 12.0)], level=30, contrast=120) for x in (40, 52)))
    later = np.maximum(*(picture(shape, [(x, 40, 12.0)], level=30, contrast=120) for x in (46, 58)))
    whole = WholePicture({0: ghost}, DETECTION, clutter(ghost > 90))
    found = whole.candidates(Sample(later, 0.0), NOT_ESTIMATED, NOT_ESTIMATED, 100.0)
    assert not whole.static.piece(0, 0, 0, *shape).any()
    assert abs(found.Xf[0] - 52) < 1


def test_what_stands_stays_clutter_where_something_dark_goes_before_it_or_the_camera_shakes():
    stand = picture(SHAPE, [(40, 40, 12.0)], level=30, contrast=120)
    hidden = stand.copy()
    hidden[:, 44:50] = 30
    shaken = picture(SHAPE, [(42, 40, 12.0)], level=30, contrast=120)
    beside = np.maximum(hidden, picture(SHAPE, [(80, 40, 12.0)], level=30, contrast=120))
    for later in (hidden, shaken, beside):
        whole = WholePicture({0: stand}, DETECTION, clutter(stand > 90))
        whole.candidates(Sample(later, 0.0), NOT_ESTIMATED, NOT_ESTIMATED, 100.0)
        left = whole.static.piece(0, 0, 0, *SHAPE)
        assert left[34:46, 34:42].all()


def test_a_change_of_light_is_no_crowd_of_candidates():
    whole = WholePicture(background(), DETECTION, None)
    bright = sample((60, 40))
    found = whole.candidates(bright._replace(luma=bright.luma + np.uint8(40)), NOT_ESTIMATED, NOT_ESTIMATED, 100.0)
    assert found.Xf.size == 0
