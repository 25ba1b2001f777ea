"""Faces: instruments of the virtual bench that speak their makers' protocols."""
