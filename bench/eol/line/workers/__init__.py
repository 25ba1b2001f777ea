"""The processes of a line: a worker for each socket, forked, watched and replaced, and what they share."""
