"""Readings over the plane of d and q current."""
