"""Safety of a run: limits, interrupts and the shutdown."""
