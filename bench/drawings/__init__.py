"""Pictures of connections, made from the actions' own data."""
