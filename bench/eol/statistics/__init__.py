"""Statistics of a line: pure, arrays in, figures out."""
