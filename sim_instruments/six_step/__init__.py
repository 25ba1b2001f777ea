"""A six-step BLDC drive, solved exactly between its switching events (§7)."""
