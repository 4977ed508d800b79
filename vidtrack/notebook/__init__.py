"""Results in Python: what `vidtrack.load` gives."""
