"""Files of other programs, read and written: one module a format.

The docstring of each module states the format's origin, handedness, angles, units and how it marks missing values, and
where that is from; docs/formats.md has the same as one table.
"""
