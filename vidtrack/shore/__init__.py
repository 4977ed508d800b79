"""The moving edge of the water along a transect."""
