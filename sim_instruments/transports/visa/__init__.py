"""A PyVISA backend in process."""
