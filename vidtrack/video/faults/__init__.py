"""How a recording was read: gaps and damage, whether flagged or found by a second look."""
