"""Interfaces between air, glass and water: as the config has them, and as calibration points show them."""
