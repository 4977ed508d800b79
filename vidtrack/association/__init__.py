"""From tracklets of every camera to trajectories in space: which of them show one target, over cameras and time."""
