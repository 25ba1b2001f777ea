"""Other people's clients, unmodified, against the served virtual bench: which of their calls are served, refused or wrong."""
