"""Switch matrix (IviSwtch): relays that make the connections instead of a person."""

from collections.abc import Collection
from typing import Protocol

from drivers.interfaces.declarations import question, reading, setting
from drivers.interfaces.identity import Instrument


class SwitchMatrix(Instrument, Protocol):
    """Relays between a motor's terminals, the instruments and the probes.

    A crosspoint joins two points and is named by them: `A:supply+` (a motor terminal and a socket, as `Socket` writes it),
    `A:voltmeter+`, `N:channel1-` (a node and an oscilloscope probe's lead), `leads:short` (the bridge's leads).
    """

    @property
    @question
    def crosspoints(self) -> frozenset[str]:
        """Names of the crosspoints that there are."""

    @property
    @question
    def fixed(self) -> frozenset[str]:
        """Names of permanent connections: leads of probes, current probes (`A:channel4~`)."""

    @setting
    def connect(self, crosspoints: Collection[str]) -> None:
        """Close exactly these crosspoints; every other one is opened first, and what is closed is read back.

        Returns once the contacts have settled. Raises CrosspointError, before anything is switched, for a crosspoint that
        there is not and for some that may not be closed together; ReportedError, with all opened, where a relay did not follow.
        """

    @reading()
    def closed(self) -> frozenset[str]:
        """Return the crosspoints that are closed now, read from the instrument."""
