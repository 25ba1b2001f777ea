"""The page of the end of line."""
