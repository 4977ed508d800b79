"""One camera from its points: closed forms, outliers, refinement, lens models, gates."""
