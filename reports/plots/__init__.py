"""Curves of a run as data, and drawn."""
