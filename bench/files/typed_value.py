"""Values as they are typed behind an equals sign."""

import tomllib
from typing import Any


def typed_value(typed: str) -> Any:
    """Return what TOML reads of it; what is no value of TOML is text."""
    try:
        return tomllib.loads(f"value = {typed}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return typed
