"""A SCPI engine: what every message-based instrument of the virtual bench has in common."""
