"""How accurate a rig is or will be: held-out errors, the floor, errors by axis, the design of targets."""
