"""Tracks in pixels that other programs digitised, one module a format: file in, `Digitised` out.

A module answers what its file holds, in the file's own coordinates, and the convention where the format has one;
what no file of the format says is None, and `placed` asks for it. `formats.read_tracks` chooses the module.
"""
