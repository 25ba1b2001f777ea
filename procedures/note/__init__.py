"""The application note, one file a section."""
