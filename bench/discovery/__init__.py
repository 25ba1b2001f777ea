"""Discovery of instruments: asked without changing anything, and matched with the drivers."""
