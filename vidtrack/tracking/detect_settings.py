"""How targets are distinguished from the background: the user's choice, and what the recording says of its pixels."""

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
    max_step       # ASSUME: share of the picture's diagonal that a target moves between samples, at most
    min_motion     px that a thing moves in the first samples before it counts as moving
    max_clutter    # ASSUME: share of the picture beyond which what is bright is scenery behind targets, no clutter
    max_occlusion  samples without a blob that could be several targets, after which they count as lost and are sought
                   elsewhere; the association in space finds out which is which
    """

    scale: float = 1.0
    full: float = 255.0
    dark: bool = False
    threshold: float | None = None
    noise: float = 1.0
    flicker: float = 0.0
    centroid: Kind = "weighted"
    min_pixels: int = 4
    max_step: float = 0.15
    min_motion: float = 1.5
    max_clutter: float = 0.25
    max_occlusion: int = 8

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
