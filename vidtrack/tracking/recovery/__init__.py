"""Targets that are lost, overlap or are new: sought again, separated, given a track of their own."""
