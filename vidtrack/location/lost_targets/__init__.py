"""Targets that a camera lost, sought again where the others show them to be."""
