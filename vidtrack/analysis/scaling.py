"""Froude's law: what a model at 1 : scale says of the full size, where gravity and inertia rule."""

from __future__ import annotations

from typing import Literal

POWERS = {"length": 1.0, "time": 0.5, "frequency": -0.5, "per_length": -1.0, "angle_per_length": -1.0, "none": 0.0}
"""The power of the scale by which a quantity of the model is multiplied."""

Quantity = Literal["length", "time", "frequency", "per_length", "angle_per_length", "none"]


def full_scale(value: float, quantity: Quantity, scale: float) -> float:
    """A quantity of the model at full size; scale: 50 for a model of 1 : 50."""
    return float(value * scale ** POWERS[quantity])
