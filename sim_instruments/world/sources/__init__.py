"""What feeds energy: supply, inverter, six-step drive, insulation tester."""
