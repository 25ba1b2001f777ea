"""Catalogues of what can be added from outside, one for each entry-point group."""
