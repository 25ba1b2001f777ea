"""The one installed name that is ours alone: the command and the pytest plug-in begin here.

The other packages bear names that a user's own folder may bear as well; that is noticed before any of them is imported.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("bench", "drivers", "procedures", "reports", "sim_instruments")


def shadowed() -> str:
    """Return a sentence about the first module that stands in front of one of ours, nothing where none does."""
    ours = Path(__file__).resolve().parents[1]
    for name in PACKAGES:
        place = _place(name)
        if place is None or place.parent != ours / name:
            return (
                f"{place or 'nothing'} stands where Python should find motorbench's own package '{name}': rename it, or keep its "
                "folder out of Python's search path (python -P; for pytest also --import-mode=importlib)"
            )
    return ""


def _place(name: str) -> Path | None:
    module = sys.modules.get(name)
    if module is not None:
        return Path(module.__file__).resolve() if module.__file__ else None
    found = find_spec(name)
    return Path(found.origin).resolve() if found is not None and found.origin else None
