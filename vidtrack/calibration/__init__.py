"""From surveyed points and where cameras saw them to the cameras, with the uncertainty of every number."""
