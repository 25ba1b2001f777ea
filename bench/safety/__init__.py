"""What keeps a run harmless: limits, interrupts and the shutdown."""
