"""Motor files: the nameplate, and the true values of a virtual motor."""
