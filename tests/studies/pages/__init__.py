"""A panel's pages, each in the state in which it is looked at."""
