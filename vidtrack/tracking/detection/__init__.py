"""What stands out of a picture: background, thresholds, blobs, what stands still, candidates for new tracks."""
