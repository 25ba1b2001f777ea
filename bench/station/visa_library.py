"""The VISA library that a station's instruments are reached by."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pyvisa import ResourceManager
    from pyvisa.highlevel import VisaLibraryBase


class StationVisa:
    """A VISA library: an installed one (`@py`, a path; empty for the vendor's), or an object.

    Its resource manager is made when the first VISA instrument is opened, so that a bench without one needs no VISA.
    """

    def __init__(self, library: "str | VisaLibraryBase") -> None:
        self._library = library
        self._manager: ResourceManager | None = None

    def manager(self) -> "ResourceManager":
        """Return the resource manager, made anew where it was closed. Raises what PyVISA raises for a library that is not there."""
        if self._manager is None:
            from pyvisa import ResourceManager

            self._manager = ResourceManager(self._library)
        return self._manager

    def close(self) -> None:
        """Close the resource manager, where there is one."""
        manager, self._manager = self._manager, None
        if manager is not None:
            manager.close()
