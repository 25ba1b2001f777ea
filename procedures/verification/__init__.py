"""Is it wired as told? Every connection is verified by a measurement before anything rests on it."""
