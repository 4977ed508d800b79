"""From lines of sight to points in the world, with covariance; whose track is whose; the plane of one camera."""
