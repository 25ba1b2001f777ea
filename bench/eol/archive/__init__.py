"""Records and runs of batches that are over: archived, restored, thinned out by rule."""
