"""Interlock contacts, by the transport that carries them."""
