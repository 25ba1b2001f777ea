"""What is known and refused before a batch's first motor."""
