"""Bases of drivers of several makers."""
