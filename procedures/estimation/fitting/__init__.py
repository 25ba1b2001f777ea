"""Least squares, intervals and noise, whatever is estimated."""
