"""Bench time: virtual, or paced by the wall's."""
