"""The simulated E36313A, a DC supply of three outputs."""
