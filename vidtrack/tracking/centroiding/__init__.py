"""Where a target is in its window: planes of the background, moments, templates, single discs, what is beside it."""
