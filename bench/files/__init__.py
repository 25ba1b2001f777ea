"""The files a user writes: motors and stations, and how they are read."""
