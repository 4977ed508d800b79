"""Whether a camera stood still, by the texture of its background: arrays in, arrays out."""
