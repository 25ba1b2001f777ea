"""The next motor at a socket, and motors that may not be tested."""
