"""Which instruments are where: asked without changing anything, matched with the drivers there are."""
