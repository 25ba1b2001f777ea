"""What several procedures do in the same way."""
