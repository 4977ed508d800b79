"""Coded tags on bodies, located by one camera or several, beside what association located."""
