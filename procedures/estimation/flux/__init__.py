"""Flux linkage over current: from readings to the map, and what follows from a map."""
