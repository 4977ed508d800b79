"""Recordings that are stored as single pictures: numbered files, pages, tiles, raw stacks."""
