"""Recordings: pictures, time stamps, time code, sound, and what is damaged."""
