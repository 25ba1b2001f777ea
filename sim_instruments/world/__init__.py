"""The virtual bench and its physics over time."""
