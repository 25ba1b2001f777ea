"""`motorbench sim`: simulations that stand alone."""
