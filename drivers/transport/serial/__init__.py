"""Instruments that only talk, over a serial line."""
