"""The virtual bench: motor physics, and instruments that speak the real protocols."""
