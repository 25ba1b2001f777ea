"""Plausibility of figures: consistency, known factor errors, and the capability of the instruments."""
