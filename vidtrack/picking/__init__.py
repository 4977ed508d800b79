"""The page on which points, start boxes and thresholds are picked: a server on this computer, for one person."""
