"""Positions in space, with time and uncertainty, from recorded video."""
