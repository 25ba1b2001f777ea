"""The motor at every current and speed: short and open circuit, load points."""
