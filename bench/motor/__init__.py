"""Motor files: the nameplate, and the truth of a virtual motor."""
