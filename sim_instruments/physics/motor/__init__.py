"""Parts of a virtual motor: windings' data, magnets, iron, bearing, Hall sensors, and its defects."""
