"""HiSLIP (IVI-6.1)."""
