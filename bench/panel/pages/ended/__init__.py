"""What a run's page shows once the run has ended."""
