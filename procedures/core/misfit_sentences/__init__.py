"""Sentences of misfits by cause: what was seen and what to do."""
