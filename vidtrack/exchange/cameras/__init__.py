"""Calibrated cameras of other programs, one module a format: file in, `Given` out; `formats.read_camera` chooses the
module.

What no file of a format says (picture size, pixel pitch, corner from which pixels are counted) is asked for, by its
key.
"""
