"""The procedures by name, in the order in which a whole measurement takes them."""

from collections.abc import Mapping
from typing import Any

from procedures.procedure import Procedure


def catalogue() -> Mapping[str, type[Procedure[Any]]]:
    """Return every procedure by its name."""
    return {}
