"""Transports: how a client reaches the faces of the virtual bench."""
