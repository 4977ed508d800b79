"""How targets are told from the background: the user's choice, with what the recording itself says of its pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from vidtrack.arrays import Picture

Kind = Literal["weighted", "binary", "ellipse"]
"""Of centroid: see `measurement.centroid.measure`."""


@dataclass(frozen=True)
class Detection:
    """Settings that every search for targets shares.

    scale       grey levels (0-255) a stored value; full: the largest stored value
    dark        targets are darker than the background
    threshold   grey level as the user wrote it; None: automatic, half-way between each target and its background
    noise       grey levels, standard deviation of a pixel beside others
    flicker     grey levels, standard deviation of a pixel from picture to picture, where a still grain makes it less
                than the noise; 0: it is the noise
    centroid    kernel that measures; min_pixels: fewer are not a target
    """

    scale: float = 1.0
    full: float = 255.0
    dark: bool = False
    threshold: float | None = None
    noise: float = 1.0
    flicker: float = 0.0
    centroid: Kind = "weighted"
    min_pixels: int = 4

    @property
    def moving_noise(self) -> float:
        """Grey levels, standard deviation of a pixel that nothing moves over."""
        return self.flicker or self.noise

    def bright(self, picture: Picture) -> Picture:
        """The picture with targets brighter than the background."""
        return picture.dtype.type(self.full) - picture if self.dark else picture

    @property
    def level(self) -> float | None:
        """The user's threshold on pictures turned bright; None where it is automatic."""
        if self.threshold is None:
            return None
        return 255.0 - self.threshold if self.dark else self.threshold
