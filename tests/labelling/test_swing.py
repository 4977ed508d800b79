"""A ball that swings is told from a dim or thin one whose pixels come and go with the noise."""

import numpy as np
import pytest

from tests.labelling.test_shot import AT, F, balls, clip
from vidtrack.labelling.shot import SWING, take


def swung(amplitude, n=8, noise=3.0, turned=0.6):
    """A clip of balls of which the third swings, `amplitude` px rms, along one line."""
    rng, way = np.random.default_rng(2), np.array([np.cos(turned), np.sin(turned)])
    phase = np.linspace(0, 2 * np.pi, n, endpoint=False)
    pictures = []
    for k in range(n):
        at = AT.copy()
        at[2] += way * amplitude * np.sqrt(2) * np.sin(phase[k])
        picture = balls(at) + rng.normal(0, noise, (96, 128))
        pictures.append(F(np.clip(np.rint(picture), 0, 255).astype(np.uint8)))
    return take(pictures, {})


@pytest.mark.parametrize("amplitude", [0.45, 1.0, 2.0, 3.5])
def test_a_ball_that_swings_is_seen_to(amplitude):
    shot = swung(amplitude)
    third = np.hypot(*(shot.at - AT[2]).T).argmin()
    assert shot.swing[third] > SWING
    assert shot.swing[third] == pytest.approx(amplitude, rel=0.15) or amplitude > 1
    assert np.delete(shot.swing, third).max() < 0.1


def thin(at, shape=(96, 128), level=30.0, background=60.0):
    """Crescents: the edges of dim balls, lit from behind; their dark sides show the background."""
    whole, cover = balls(at, level=1.0, background=0.0), balls(at - [1.7, 0.4], level=1.0, background=0.0, radius=3.9)
    return background + level * np.clip(whole - cover, 0, 1)


def test_a_thin_crescent_in_noise_scatters_and_does_not_swing():
    scattering = 0
    for seed in range(8):
        shot = take(clip(thin(AT), 3, seed=seed, noise=4.0), {})
        scattering += (np.hypot(*shot.scatter.T) > SWING).sum()
        assert not (shot.swing > SWING).any()
    assert scattering > 5


def test_a_swinging_crescent_is_seen():
    rng = np.random.default_rng(1)
    pictures = [thin(AT + np.array([off, 0])) + rng.normal(0, 2.0, (96, 128)) for off in (-1.2, 0.0, 1.2)]
    shot = take([F(np.clip(np.rint(picture), 0, 255).astype(np.uint8)) for picture in pictures], {})
    assert (shot.swing > SWING).any()
