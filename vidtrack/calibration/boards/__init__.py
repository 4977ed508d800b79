"""Flat boards: their corners in pictures, which corner is which, and cameras from their views."""
