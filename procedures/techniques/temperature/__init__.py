"""The temperature of winding and magnets."""
