"""What a run's journal and a guardian's record hold: one class a kind, by subject."""
