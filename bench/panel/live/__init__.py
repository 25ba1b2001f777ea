"""Runs and batches that go on, as a page shows them."""
