"""Runs with a fault of an instrument."""
