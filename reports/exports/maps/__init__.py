"""Flux maps for simulators and controllers."""
