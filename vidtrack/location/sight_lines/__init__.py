"""How far lines of sight miss, why, and what the uncertainty of a position consists of."""
