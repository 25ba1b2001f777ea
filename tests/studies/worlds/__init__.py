"""Records, motors and benches with a known truth, for studies and tests."""
