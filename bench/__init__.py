"""The application: everything that a person or a line starts."""
