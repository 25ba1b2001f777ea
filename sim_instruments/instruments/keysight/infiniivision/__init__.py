"""The simulated InfiniiVision, an oscilloscope."""
