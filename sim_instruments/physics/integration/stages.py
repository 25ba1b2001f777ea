"""Stages of an integration step, written out for a number of states: at a swing's few, a list costs more than its arithmetic."""

from collections.abc import Callable, Sequence
from typing import Any


def weighted(weights: Sequence[float], terms: Sequence[str]) -> str:
    """Return the text of a sum of terms with their weights, those of weight zero left out."""
    return " + ".join(f"{weight!r} * {term}" for weight, term in zip(weights, terms, strict=True) if weight)


def numbered(name: str, states: int) -> str:
    """Return the text of one variable for each state: "k0, k1, k2"."""
    return ", ".join(f"{name}{state}" for state in range(states))


def compiled(head: str, lines: Sequence[str]) -> Callable[..., Any]:
    """Return the function with this head, "stages(law, state)", and these lines."""
    scope: dict[str, Any] = {}
    exec("\n    ".join((f"def {head}:", *lines)), scope)  # noqa: S102  the text is made of a method's table only
    return scope[head.partition("(")[0]]  # type: ignore[no-any-return]
