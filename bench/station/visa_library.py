"""The VISA library that a station names."""

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pyvisa import ResourceManager
    from pyvisa.highlevel import VisaLibraryBase


def system_visa(library: "str | VisaLibraryBase") -> "Callable[[], ResourceManager]":
    """Return what makes a resource manager of a VISA library: an installed one (`@py`, a path; empty for the vendor's), or an object."""

    def make() -> "ResourceManager":
        from pyvisa import ResourceManager

        return ResourceManager(library)

    return make
