"""A wall with a pattern before a camera that turns: pictures as arrays, with noise, and what else may be in them."""

from fractions import Fraction

import cv2
import numpy as np
from scipy.ndimage import map_coordinates, spline_filter

from vidtrack.geometry.camera import Camera
from vidtrack.simulate.rig import look_at
from vidtrack.steadiness.samples import BackgroundSamples, Keeping
from vidtrack.steadiness.series import Targets, background_course
from vidtrack.steadiness.turn import fitted, law_of_camera
from vidtrack.timing.frame import Frame

F = 500.0
MARGIN = 50
NO_TARGETS = Targets(np.empty(0, np.int64), np.empty((0, 2)), np.empty(0))


def camera(size=(320, 240)):
    place = np.array([0.0, -100.0, 50.0])
    R = look_at(place, (0, 0, 0))
    return Camera((size[0] - 1) / 2 + 3, (size[1] - 1) / 2 - 2, 1, 1, 1, F, 1e-7, R, -R @ place, size)


class Wall:
    """A random pattern, seen by a camera that moved by theta."""

    def __init__(self, rng, contrast=12.0, grain=1.8, size=(320, 240)):
        self.camera, self.rng = camera(size), rng
        self.law = law_of_camera(self.camera)
        pattern = cv2.GaussianBlur(rng.normal(0, 1, (size[1] + 2 * MARGIN, size[0] + 2 * MARGIN)), (0, 0), grain)
        self._spline = spline_filter(60 + contrast * pattern / pattern.std())
        x, y = np.meshgrid(np.arange(size[0], dtype=float), np.arange(size[1], dtype=float))
        self.grid = np.stack([x, y], -1)

    def clean(self, theta=(0, 0, 0, 0)):
        theta, b = np.asarray(theta, float), self.grid.copy()
        if theta.any():
            for _ in range(6):
                b += self.grid - self.law(b, theta)
        at = b[..., ::-1].transpose(2, 0, 1) + MARGIN
        return map_coordinates(self._spline, at, order=3, prefilter=False, mode="nearest")

    def film(self, thetas, noise=3.0, light=lambda k: 1.0, over=None, quality=None):
        """Frames; over: changes a picture before its noise; quality: of a JPEG that each passes through."""
        known = {}
        for k, theta in enumerate(thetas):
            key = tuple(np.asarray(theta, float))
            if key not in known:
                known[key] = self.clean(theta)
            picture = known[key] * light(k)
            picture = over(k, picture) if over else picture
            levels = np.clip(np.rint(picture + self.rng.normal(0, noise, picture.shape)), 0, 255).astype(np.uint8)
            if quality:
                levels = cv2.imdecode(cv2.imencode(".jpg", levels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 0)
            yield Frame(k, Fraction(k, 30), levels, False, None)


def course_of(frames, targets=NO_TARGETS, **keeping):
    samples = BackgroundSamples(Keeping(**{"first": 4, "stride": 1, **keeping}))
    for _ in samples.over(frames):
        pass
    return background_course(samples, targets, scale=1.0)


def turns(wall, course):
    size = wall.camera.image_size
    return [fitted(wall.law, course.middles, s, sd, size) for s, sd in zip(course.shift, course.sd, strict=True)]
