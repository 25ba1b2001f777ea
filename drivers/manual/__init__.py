"""Instruments without an interface: a person sets them and types in what they show."""
