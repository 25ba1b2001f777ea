"""What is on the bench and what happens there over time."""
