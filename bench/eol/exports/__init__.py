"""Records for other programs: one format a module, each written while it is read."""
