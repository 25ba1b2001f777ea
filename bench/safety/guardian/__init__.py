"""A process of its own that carries out the shutdown when the run's process cannot."""
