"""Integration of a rotor that swings under current, step by step."""
