"""Whoever has hands: a person at a terminal, a virtual operator, a file of answers."""
