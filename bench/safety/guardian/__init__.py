"""A process of its own that takes the way down when the run's process cannot."""
