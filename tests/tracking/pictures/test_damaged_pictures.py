import pickle
from fractions import Fraction

import numpy as np
import pytest

from vidtrack.timing.frame import Coded, Frame
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures, kept_others, without_damaged
from vidtrack.tracking.state import CORRUPT, MEASURED, PREDICTED, Rows, present

SIZE = 128, 192
N = 24


def scene(seed=0, balls=3, speed=3.0, n=N):
    """Pictures (n, height, width) of balls that move over a still texture, grey levels with noise."""
    rng = np.random.default_rng(seed)
    Y, X = np.mgrid[: SIZE[0], : SIZE[1]].astype(float)
    still = 80 + 15 * np.sin(X / 6) * np.cos(Y / 8) + rng.normal(0, 4, SIZE)
    out = np.empty((n, *SIZE))
    for i in range(n):
        out[i] = still + rng.normal(0, 1.5, SIZE)
        for k in range(balls):
            x, y = (20 + 50 * k + speed * (1 - 2 * (k % 2)) * i) % SIZE[1], 20 + 40 * k
            out[i][np.hypot(X - x, Y - y) < 7] = 200
    return out


def garbage(pictures, which, *, seed=5, blocks=40):
    """Blocks of 8 x 8 pixels, scattered, that some pictures show instead."""
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(0, SIZE[0] // 8, blocks), rng.integers(0, SIZE[1] // 8, blocks)
    hurt = pictures.copy()
    for row, column in zip(8 * rows, 8 * columns, strict=True):
        block = rng.uniform(-60, 60) + 30 * rng.choice([-1, 1], (4, 4)).repeat(2, 0).repeat(2, 1)
        hurt[which, row : row + 8, column : column + 8] += block
    return hurt


def in_order(n, keys):
    """What is known of pictures that are coded as they are shown, each built on the one before it but for these."""
    return [Coded(i, sum(key <= i for key in keys), i in keys, False) for i in range(n)]


def frames_of(pictures, *, bits=8, corrupt=(), coded=None):
    levels = np.clip(np.rint(pictures), 0, 255).astype(np.uint8 if bits == 8 else np.uint16)
    coded = coded or [None] * len(levels)
    return [Frame(i, Fraction(i, 30), p << (bits - 8), i in corrupt, None, coded[i]) for i, p in enumerate(levels)]


def found(pictures, *, bits=8, corrupt=(), coded=None):
    frames = frames_of(pictures, bits=bits, corrupt=corrupt, coded=coded)
    damage = DamagedPictures(bits)
    assert list(damage.over(frames)) == frames
    return sorted(damage.indices)


@pytest.mark.parametrize("which", [[9], [9, 10, 11, 12, 13], [1], [1, 2, 3], list(range(5, 22))])
def test_blocks_of_the_background_that_leave_and_come_back_with_a_key_frame_are_damage(which):
    hurt = garbage(scene(), which)
    assert found(hurt, coded=in_order(N, (0, which[-1] + 1))) == which
    assert found(hurt, coded=in_order(N, (0, which[0], which[-1] + 1))) == which
    assert found(hurt, coded=in_order(N, (0, which[-1]))) == []
    assert found(hurt) == (which if len(which) <= 3 else [])


def test_a_picture_that_nothing_is_built_on_and_one_that_others_were_coded_before_may_be_damaged():
    """I b b P b b P ...: P is coded before the b that are shown before it; with B a b is built upon, with p nothing."""
    alone = [Coded(i, 0, i == 0, i % 3 > 0) for i in range(N)]
    hurt = garbage(scene(), [7])
    assert found(hurt, coded=alone) == [7]
    assert found(hurt, coded=in_order(N, (0,))) == []
    pyramid = [Coded(i - 2 if i % 3 == 0 and i else i + 1, 0, i == 0, False) for i in range(N)]
    assert found(garbage(scene(), [7, 8]), coded=pyramid) == [7, 8]
    assert found(garbage(scene(), [7]), coded=pyramid) == []
    assert found(garbage(scene(), [6, 7, 8]), coded=pyramid) == []


@pytest.mark.parametrize(
    ("keys", "codec", "copied"),
    [
        ((0,), "h264", True),
        ((0,), "", True),
        ((0, 1, 2, 3), "h264", False),
        (None, "h264", False),
        ((0,), "ffv1", False),
    ],
)
def test_whether_pictures_copy_the_errors_of_others_is_known(keys, codec, copied):
    pictures = np.full((4, 16, 16), 80, np.uint8)
    coded = [None] * 4 if keys is None else in_order(4, keys)
    damage = DamagedPictures(8, codec=codec)
    list(damage.over(Frame(i, Fraction(i, 30), p, False, None, coded[i]) for i, p in enumerate(pictures)))
    assert damage.copied is copied


def test_damage_reaches_to_the_key_frame_where_pictures_before_it_that_are_coded_behind_it_are_partly_back():
    coded = [Coded(i, int(i >= 9), i == 11, False) for i in range(N)]
    coded[11], coded[10], coded[9] = Coded(9, 1, True, False), Coded(11, 1, False, False), Coded(10, 1, False, False)
    assert found(garbage(scene(), [7, 8]), coded=coded) == [7, 8, 9, 10]


def test_what_is_coded_behind_a_damaged_picture_and_shown_before_it_is_built_on_it():
    """I P b b ...: the first b has little of the damage."""
    coded = [Coded(i - 2 if i % 3 == 0 and i else i + 1, int(i >= 12), i in (0, 12), False) for i in range(N)]
    coded[0] = Coded(0, 0, True, False)
    assert found(garbage(scene(), [9, 10, 11]), coded=coded) == [7, 8, 9, 10, 11]


def test_a_camera_that_shakes_is_no_damage_and_damage_while_it_shakes_is():
    rng = np.random.default_rng(2)
    still = scene(balls=0)
    for seed in range(3):
        by = np.random.default_rng(seed).integers(-9, 10, (N, 2)) * (rng.random((N, 1)) < 0.3)
        shaken = np.array([np.roll(p, tuple(d), (0, 1)) for p, d in zip(still, by, strict=True)])
        assert found(shaken) == []
    by[8:11] = 0
    shaken = np.array([np.roll(p, tuple(d), (0, 1)) for p, d in zip(still, by, strict=True)])
    assert 9 in found(garbage(shaken, [9], blocks=60))


@pytest.mark.parametrize("speed", [8, 16, 30])
def test_something_large_that_crosses_the_picture_is_no_damage(speed):
    pictures = scene(balls=0, n=40)
    for i in range(40):
        left = speed * (i - 5)
        pictures[i][:, max(0, left) : max(0, left + 64)] = 180
    assert found(pictures) == []


def test_what_is_damaged_is_recorded():
    assert DamagedPictures(8).as_record() == {}
    damage = DamagedPictures(8)
    damage.indices |= {5, 3}
    assert damage.as_record() == {"damage_seen": [3, 5]}


def test_deep_pictures_are_looked_at_alike():
    assert found(garbage(scene(), [7, 8]), bits=12) == [7, 8]


def test_garbage_that_spreads_while_it_lasts_is_damage_from_its_first_picture_on():
    hurt = garbage(scene(), list(range(8, 15)))
    coded = in_order(N, (0, 15))
    assert found(garbage(hurt, list(range(11, 15)), seed=6), coded=coded) == list(range(8, 15))


def test_pictures_that_the_decoder_calls_damaged_are_not_looked_at():
    assert found(garbage(scene(), [9]), corrupt=(9,)) == []


@pytest.mark.parametrize("speed", [0.0, 1.0, 6.0, 20.0])
@pytest.mark.parametrize("balls", [0, 3])
def test_targets_that_move_are_no_damage(speed, balls):
    assert found(scene(speed=speed, balls=balls)) == []


def test_a_flash_or_a_lamp_that_is_switched_on_and_off_is_no_damage():
    for which in ([9], list(range(9, 15))):
        brighter = scene()
        brighter[which] *= 1.3
        assert found(brighter) == []
        spot = scene()
        Y, X = np.mgrid[: SIZE[0], : SIZE[1]]
        spot[which] += 60 * np.exp(-((X - 90) ** 2 + (Y - 60) ** 2) / 800)
        assert found(spot) == []


def test_a_hand_before_the_lens_is_no_damage():
    covered = scene(balls=0) / 10 + 25  # dark, but for a few lit things
    covered[:, :, ::5] += 190
    covered[8:10] = np.random.default_rng(1).normal(16, 1, covered[8:10].shape)
    assert found(covered) == []


def test_a_change_that_lasts_is_no_damage():
    assert found(garbage(scene(), list(range(9, N)))) == []


@pytest.mark.parametrize("coded", [None, in_order(N, range(0, N, 3))])
def test_pictures_since_a_change_that_has_come_to_stay_are_not_remembered(coded):
    """Two hours of them take 45 MB."""
    damage = DamagedPictures(8)
    held = []
    for _ in damage.over(frames_of(garbage(scene(), list(range(9, N))), coded=coded)):
        held.append(len(damage._seen))
    assert max(held) >= 3
    assert held[-1] == 1


def test_waves_and_glitter_are_no_damage():
    rng = np.random.default_rng(3)
    pictures = scene(n=60)
    for picture in pictures:
        for row, column in rng.integers(0, (64, SIZE[1] - 3), (12, 2)):
            picture[row : row + 3, column : column + 3] = 230
    assert found(pictures) == []


def rows():
    values = np.ones((MEASURED, 4, 2))
    return Rows(values, np.zeros((4, 2, 2)), np.zeros((4, 2), np.int64), np.zeros(4))


def test_nothing_is_measured_in_damaged_samples():
    damaged = np.array([False, True, True, False])
    out = without_damaged(rows(), damaged)
    assert present(out).tolist() == [[True] * 2, [False] * 2, [False] * 2, [True] * 2]
    assert (out.flag[damaged] == CORRUPT | PREDICTED).all()
    assert (out.flag[~damaged] == 0).all()
    assert without_damaged(rows(), np.zeros(4, bool)).flag.sum() == 0


def test_other_tracks_have_no_samples_in_damaged_pictures():
    sample = np.array([0, 1, 2, 2, 3])
    others = Others(np.arange(5), sample, np.arange(MEASURED * 5.0).reshape(MEASURED, 5), np.zeros(5, np.int64))
    kept = kept_others(others, np.array([False, False, True, False]))
    assert kept.sample.tolist() == [0, 1, 3]
    assert kept.values[0].tolist() == [0, 1, 4]


def test_sudden_changes_and_what_precedes_damage_get_a_second_look():
    asked = []

    def look_again(indices):
        asked.append(indices)
        return {12, 13}

    lasting = garbage(scene(), list(range(12, N)))
    levels = np.clip(np.rint(lasting), 0, 255).astype(np.uint8)
    frames = [Frame(i, Fraction(i, 30), p, i == 5, None) for i, p in enumerate(levels)]
    damage = DamagedPictures(8, look_again)
    assert list(damage.over(frames)) == frames
    [at] = asked
    assert {0, 4, 12} <= set(at)
    assert at[0] == 4  # what precedes damage is the most doubtful of its kind
    assert len(set(at)) == len(at)
    assert damage.indices == {12, 13}


@pytest.mark.parametrize("keys", [(0, 12), range(N)])
def test_what_another_process_looked_at_is_known_here_at_the_end_and_asked_about_here(keys):
    frames = frames_of(garbage(garbage(scene(), [9]), [17], blocks=3), corrupt=[5], coded=in_order(N, keys))
    asked = []
    here, there, away = (DamagedPictures(8, lambda at: asked.append(at) or {at[-1]}) for _ in range(3))
    assert list(here.over(frames)) == frames
    assert list(there.monitored(frames)) == frames

    def passing():
        away.elsewhere()
        for frame in frames:
            assert away.indices == set()
            yield frame
        away.taken(pickle.loads(pickle.dumps(there.seen())))

    assert list(away.over(passing())) == frames
    assert len(asked) == 2
    assert asked[0] == asked[1]
    assert away.indices == here.indices
    assert away.copied == here.copied == (keys != range(N))


def asked_of(pictures):
    """The frames that get a second look, look by look."""
    asked = []
    levels = np.clip(np.rint(pictures), 0, 255).astype(np.uint8)
    frames = [Frame(i, Fraction(i, 30), p, False, None) for i, p in enumerate(levels)]
    assert list(DamagedPictures(8, lambda indices: asked.append(sorted(indices)) or set()).over(frames)) == frames
    return asked


@pytest.mark.parametrize("balls", [0, 3, 8])
def test_where_nothing_changes_suddenly_the_first_picture_alone_gets_a_second_look(balls):
    """Damage in it shows in no change."""
    assert asked_of(scene(balls=balls)) == [[0]]


def test_a_few_blocks_far_from_what_moves_get_a_look_of_their_own_beside_many_that_move():
    lasting = garbage(scene(balls=3), list(range(12, N)), blocks=4)
    assert [12 in one for one in asked_of(lasting)] == [True]


def test_the_picture_before_lost_ones_gets_a_second_look():
    """What is lost behind it may begin in it."""
    asked = []
    levels = np.clip(np.rint(scene()), 0, 255).astype(np.uint8)
    frames = [Frame(i, Fraction(i + 6 * (i > 9), 30), p, False, None) for i, p in enumerate(levels)]
    list(DamagedPictures(8, lambda indices: asked.extend(indices) or set()).over(frames))
    assert set(asked) == {0, 9}


def test_two_blocks_far_from_what_moves_get_a_second_look():
    """Of a reference that is damaged near its end no more may show."""
    lasting = garbage(scene(), list(range(12, N)), blocks=2)
    assert [12 in one for one in asked_of(lasting)] == [True]


def test_two_pictures_of_one_moment_are_read():
    times = [0, 1, 1, 2, 5, 6]
    frames = [f._replace(time=Fraction(t, 30)) for f, t in zip(frames_of(scene(n=6)), times, strict=True)]
    assert [one.index for one in DamagedPictures(8).over(frames)] == list(range(6))
