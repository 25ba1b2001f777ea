"""What simulated oscilloscopes are made of: acquisition, records, edges, channels, trigger, readings of the screen."""
