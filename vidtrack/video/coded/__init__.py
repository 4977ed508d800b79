"""Coded pictures before they are decoded: packets, units, groups, and the order of coding."""
