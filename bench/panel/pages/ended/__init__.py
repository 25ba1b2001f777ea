"""A run's page once the run has ended."""
