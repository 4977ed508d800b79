"""Discs fitted together: targets that overlap or touch, or of which something hides a part."""
