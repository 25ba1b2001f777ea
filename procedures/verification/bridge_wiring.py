"""Connections to an LCR meter, proved by its own readings."""

from collections.abc import Callable, Sequence

from drivers.interfaces import ImpedanceReading, SetpointError
from procedures.core.actions import Connect
from procedures.estimation.winding.wiring import Outcome
from procedures.verification import by_bridge
from procedures.verification.by_bridge import BridgeSettings
from procedures.verification.check import Check
from procedures.verification.two_poles import poles_of
from procedures.verification.verification import Proof

#: Test frequencies (Hz) up to which a winding shows its direct-current resistance, and the one to ask a bridge for.
_NEARLY_DIRECT, _LOW = 120.0, 20.0


class BridgeWiring:
    """Connections to the bridge."""

    def __init__(self, proof: Proof) -> None:
        self._proof = proof
        self._bench = proof.bench

    def connect(self, connect: Connect, settings: BridgeSettings) -> None:
        """Connect the terminals to the bridge, prove it with one reading at a low frequency, and leave the bridge set."""
        self._bench.perform(connect)
        if self._bench.lcr_meter.read_by_hand:
            self._set(settings)
            self._proof.verify(connect, lambda: Check(Outcome.UNPROVED, "lcr_meter", reason="by hand"))
            return
        try:
            self._set(BridgeSettings(self._proof.lines.bridge_frequency or _LOW, settings.level, settings.aperture))
        except SetpointError:
            # A bridge without such a frequency tells a path from none all the same.
            self._set(settings)
            self._proof.verify(connect, lambda: by_bridge.judged(connect, self._read(), None))
            return
        self._proof.verify(connect, lambda: self._held_against_others(connect))
        self._set(settings)

    def line(self, connect: Connect, frequency: float) -> ImpedanceReading:
        """Connect two terminals to the bridge, which is set to a frequency (Hz); prove it by a reading, and return that."""
        self._bench.perform(connect)
        lines = self._proof.lines
        reference = lines.for_bridge(self._proof.known) if frequency <= _NEARLY_DIRECT else None
        taken: list[ImpedanceReading] = []

        def check() -> Check:
            reading = self._read()
            taken[:] = [] if reading is None else [reading]
            return by_bridge.judged(connect, reading, reference)

        self._proof.verify(connect, check)
        return taken[0]

    def compare_lines(
        self, connects: Sequence[Connect], lines: Callable[[], Sequence[float]], read_again: Callable[[int], None]
    ) -> None:
        """Hold the readings (Ω) of AB, BC, CA against each other; `read_again` has one of them made anew."""
        self._proof.compare(connects, lambda which: by_bridge.compared(lines(), which), read_again)

    def _held_against_others(self, connect: Connect) -> Check:
        lines = self._proof.lines
        reference = lines.for_bridge(self._proof.known) or lines.supposed_for_bridge()
        reading = self._read()
        found = by_bridge.judged(connect, reading, reference)
        if reference is None and reading is not None:
            lines.suppose("lcr_meter", poles_of(connect), by_bridge.like(reading))
        return found

    def _read(self) -> ImpedanceReading | None:
        return by_bridge.read(self._bench.lcr_meter)

    def _set(self, settings: BridgeSettings) -> None:
        self._bench.lcr_meter.configure(settings.frequency, settings.level, settings.aperture)
