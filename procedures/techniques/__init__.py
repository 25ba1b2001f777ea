"""Techniques that several procedures share."""
