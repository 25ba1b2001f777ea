"""A plan tried on a virtual twin of the station before anything is energised: every set point and action, against its limit."""
