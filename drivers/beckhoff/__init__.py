"""Beckhoff bus couplers as relays with a watchdog."""
