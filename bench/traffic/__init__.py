"""The traffic of a session with instruments as a file: recorded, read, and replayed through the drivers."""
