"""Is it connected as intended? Every connection is verified by a measurement before a reading is taken through it."""
