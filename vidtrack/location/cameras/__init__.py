"""What each camera of a run saw, in the pictures of its calibration, and whether it is that camera's."""
