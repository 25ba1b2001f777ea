"""Every target by its name."""

import logging
from importlib import import_module

from tests.studies.fuzz.target import Target

#: Replies, files, what is sent to the virtual bench; each imports much that the others do not need.
_MODULES = ("replies", "files", "served")


def all_targets() -> dict[str, Target]:
    """Return all targets in order; libraries log nothing from then on."""
    return {target.name: target for module in _MODULES for target in _targets_of(module)}


def find(name: str) -> Target:
    """Return one target and import no more than it needs. Raises KeyError for a name that is none."""
    for module in _MODULES:
        for target in _targets_of(module):
            if target.name == name:
                return target
    raise KeyError(name)


def _targets_of(module: str) -> tuple[Target, ...]:
    logging.disable()
    found: tuple[Target, ...] = import_module(f"tests.studies.fuzz.{module}").targets()
    return found
