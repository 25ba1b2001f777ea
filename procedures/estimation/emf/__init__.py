"""Estimates from the voltages of a turning machine."""
