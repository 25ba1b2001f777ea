"""Lutron tachometers on a serial line."""
