"""Self-calibration by a rigid body whose targets lie at known distances, while it floats.

sights   what the cameras saw of the body, and where it was at each moment
fit      the adjustment: cameras as another calibration knows them, the body's shape, a pose a moment
shape    whether the stated places of the targets are what the cameras see; which one is not
heldout  whether refined cameras predict stretches of time better that they have not seen
"""
