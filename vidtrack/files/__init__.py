"""The doors: the only place where paths are opened."""
