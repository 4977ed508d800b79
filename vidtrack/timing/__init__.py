"""When a frame was: time code, time bases, fields, and the clocks of cameras that are not locked together."""
