"""The six degrees of freedom of a rigid body, by the names of naval architecture."""

DEGREES_OF_FREEDOM = ("surge", "sway", "heave", "roll", "pitch", "yaw")
"""Translations along, then turns about, the axes x, y, z of the basin."""
