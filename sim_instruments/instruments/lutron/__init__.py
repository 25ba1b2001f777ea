"""Simulated Lutron tachometer."""
