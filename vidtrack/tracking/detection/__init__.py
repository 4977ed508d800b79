"""What in a picture can be a target: background, thresholds, blobs, static clutter."""
