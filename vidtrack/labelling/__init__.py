"""Which calibration ball is which: stills, poses and names, from a few picks or from the layout alone."""
