"""Mode plane: one camera, and the plane in which the target moves."""
