"""Units of length: what `units` of config.yaml may be, in metres, and the words that people write for them."""

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}

WORDS = {
    "m": ("m", "metre", "metres", "meter", "meters"),
    "cm": ("cm", "centimetre", "centimetres", "centimeter", "centimeters"),
    "mm": ("mm", "millimetre", "millimetres", "millimeter", "millimeters"),
    "um": ("um", "µm", "μm", "micron", "microns"),
    "km": ("km", "kilometre", "kilometres", "kilometer", "kilometers"),
    "in": ("in", "inch", "inches", '"', "in."),
    "ft": ("ft", "foot", "feet", "'", "ft."),
    "yd": ("yd", "yard", "yards"),
}
"""Those of headers and titles too that `units` may not be, so that they are recognised there."""
