"""What keeps a run harmless: limits, interrupts and the way down."""
