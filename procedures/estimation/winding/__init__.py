"""Resistance and inductance of the winding."""
