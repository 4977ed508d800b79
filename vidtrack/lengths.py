"""Units of length: what `units` of config.yaml may be, in metres."""

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
