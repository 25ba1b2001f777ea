"""A line of sockets: motors measured side by side, instruments shared, one writer of records."""
