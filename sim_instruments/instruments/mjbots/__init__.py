"""Simulated instruments of mjbots."""
