"""States in which a last user may have left an instrument, drawn from the instrument's own table."""

from collections.abc import Sequence
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np

One = TypeVar("One")
#: Rows of alternatives, program messages of which one has been sent last; an empty one leaves what switching on gives.
Leftovers = tuple[tuple[str, ...], ...]


@runtime_checkable
class HasFoundState(Protocol):
    """An instrument that has a table of what a last user may have left."""

    def leave(self, generator: np.random.Generator) -> tuple[str, ...]:
        """Bring it into a state drawn from its table, and return that state in words."""


def drawn(generator: np.random.Generator, alternatives: Sequence[One]) -> One:
    """Return one of several, each equally likely."""
    return alternatives[int(generator.integers(len(alternatives)))]
