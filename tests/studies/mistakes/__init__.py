"""Mistakes in drivers, one at a time."""
