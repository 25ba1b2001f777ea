"""Runs with everything energised, for those who end them."""
