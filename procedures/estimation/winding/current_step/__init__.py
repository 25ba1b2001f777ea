"""Resistance and inductance from a recorded current step (§3.3.1)."""
