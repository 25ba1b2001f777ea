"""How an instrument of each role is used by the conformance checks, and what its actual state must then be."""
