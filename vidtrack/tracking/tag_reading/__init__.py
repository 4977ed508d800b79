"""Coded tags in pictures: found, read, their corners measured, their paper painted over."""
