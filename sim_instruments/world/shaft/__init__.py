"""The shaft, coupled, free, or in a hand."""
