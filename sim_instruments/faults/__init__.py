"""Faults brought onto the bench as described in a file, a flag or a request, at their time."""
