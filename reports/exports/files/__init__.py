"""Parameters as plain files."""
