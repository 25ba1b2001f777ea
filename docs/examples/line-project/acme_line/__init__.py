"""What a line of Acme has of its own."""
