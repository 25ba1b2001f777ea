"""The winding: aligned, read by bridge and meters, stepped."""
