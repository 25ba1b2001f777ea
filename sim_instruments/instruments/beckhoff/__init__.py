"""Simulated Beckhoff couplers."""
