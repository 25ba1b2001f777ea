"""d- and q-axis inductance from readings while the rotor is turned (§3.3.2)."""
