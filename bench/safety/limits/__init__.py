"""Limits in front of every instrument."""
