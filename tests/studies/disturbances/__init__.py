"""Disturbances of a bench, drawn from negligible to gross, and what the figures then say."""
