"""Disturbances of a real bench beyond its instruments' limits of error: probes, channels, shaft sensors, contacts, hands."""
