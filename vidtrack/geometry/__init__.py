"""Cameras, lines of sight and where they meet; arrays in, arrays out."""
