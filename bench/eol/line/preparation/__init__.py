"""Checks and facts before a batch's first motor."""
