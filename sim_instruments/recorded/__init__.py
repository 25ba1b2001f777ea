"""Instruments that answer as a recording has them answer."""
