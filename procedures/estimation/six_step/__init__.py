"""Currents and resistances of a six-step drive."""
