"""Which motor comes next at a socket, and which may not be tested."""
