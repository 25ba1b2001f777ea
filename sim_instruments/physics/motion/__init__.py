"""Laws of motion of a shaft."""
