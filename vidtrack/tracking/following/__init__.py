"""Within one camera: where a target is expected next, and what happens where two meet."""
