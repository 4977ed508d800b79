"""Calibration by a wand: two or three balls at known distances, waved through the volume; nothing is surveyed.

ends      which ball of a picture is which end of the wand, within stretches in which a track keeps its ball
pairs     two cameras without any common reference: fundamental matrix, focal lengths, pose
rig       all cameras, one after the other, from the first pair
refined   the adjustment of all of them: outliers, lens model, clocks
axes      where the world's axes lie
"""
