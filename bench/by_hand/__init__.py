"""The station's instruments by hand: commands typed one after the other, within the limits, in the journal."""
