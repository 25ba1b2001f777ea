"""What a procedure is made of."""
