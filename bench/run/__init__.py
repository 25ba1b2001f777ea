"""One run: its plan, its context, the sequencer that works through it, and how it is resumed."""
