"""Instruments on a CAN bus."""
