"""End of line: plans, limits, batches and their records."""
