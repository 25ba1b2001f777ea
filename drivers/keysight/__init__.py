"""Keysight bench instruments over SCPI."""
