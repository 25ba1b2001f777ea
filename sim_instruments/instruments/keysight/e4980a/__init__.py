"""The simulated E4980A, an LCR meter."""
