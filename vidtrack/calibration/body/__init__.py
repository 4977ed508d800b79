"""Self-calibration by a rigid body whose targets lie at known distances, while it floats.

body_sights   what the cameras saw of the body, and where it was at each moment
body_fit      the adjustment: cameras as another calibration knows them, the body's shape, a pose a moment
body_shape    whether the stated places of the targets are what the cameras see; which one is not
body_heldout  whether refined cameras predict stretches of time better that they have not seen
"""
