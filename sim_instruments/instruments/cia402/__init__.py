"""Simulated drives with the CiA 402 profile."""
