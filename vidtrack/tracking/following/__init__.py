"""What is known of targets from sample to sample: predictions, occlusions, usual sizes, records, tracklets."""
