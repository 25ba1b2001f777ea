"""What a virtual motor is made of: windings' data, magnets, iron, bearing, Hall sensors, and its defects."""
