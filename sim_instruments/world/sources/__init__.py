"""Sources of energy: supply, inverter, six-step drive, insulation tester."""
