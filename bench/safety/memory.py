"""Excludes what a run has loaded from the garbage collector, which stops every thread while it searches."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

from bench.journal.events.instruments import InstrumentOpened
from procedures.core.events import Event


@contextmanager
def set_aside() -> Iterator[None]:
    """Set aside what there is, for the length of the block: looking it through costs 40 to 80 ms, in which no heartbeat goes out."""
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def set_aside_newly_loaded(event: Event) -> None:
    """Set aside what an instrument's driver has loaded, once it is open."""
    if isinstance(event, InstrumentOpened):
        gc.freeze()
