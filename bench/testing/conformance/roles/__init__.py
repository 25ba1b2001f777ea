"""The use of an instrument of each role in the conformance checks, and its expected actual state."""
