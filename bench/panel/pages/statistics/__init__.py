"""The page of the line's statistics."""
