"""Events of a run's journal and of a guardian's record: one class for each kind, by subject."""
