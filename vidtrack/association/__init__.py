"""From tracklets of every camera to trajectories in space: who is who over cameras and over time."""
