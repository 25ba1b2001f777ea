"""Station files: which instruments stand on a bench, their limits, calibrations, interlocks and shutdown list."""
