"""Parameters for simulators."""
