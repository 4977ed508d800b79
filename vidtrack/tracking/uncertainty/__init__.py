"""What the sd of a centroid must hold beside noise and contrast, from the tracks: coding, shape, motion blur."""
