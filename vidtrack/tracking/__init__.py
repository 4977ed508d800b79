"""From pictures to centroids: thresholds, moving boxes, lost targets sought again, and how well it went."""
