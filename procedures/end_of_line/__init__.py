"""Checks at the end of a line that are no part of the note."""
