"""Connections to an LCR meter, verified by a reading of its own at a low frequency."""

from collections.abc import Mapping

from drivers.interfaces import Aperture, ImpedanceReading, SetpointError
from procedures.core.actions import Connect, LinePair, Wanted, meter_across
from procedures.estimation.winding.wiring import WiringOutcome
from procedures.verification import bridge_evidence
from procedures.verification.check import Check
from procedures.verification.lines import Reference
from procedures.verification.two_poles import poles_of
from procedures.verification.verifier import VerifiedWiring

#: Test frequencies (Hz) up to which a winding shows its direct-current resistance, and the one to ask a bridge for.
_NEARLY_DIRECT, _LOW = 120.0, 20.0


class BridgeWiring(VerifiedWiring):
    """Connections to the bridge."""

    def connect(
        self, connect: Connect, frequency: float, level: float, aperture: Aperture, *beside: Wanted
    ) -> float | None:
        """Connect the terminals to the bridge, with what else is wanted of the setup, and verify that by one reading, whose resistance (Ω)
        is returned; None where there is none.

        The bridge has these settings and keeps them. Where the frequency (Hz) is low, the line's resistance is about to be
        measured: the reading is taken at that frequency, and is compared with earlier runs and instruments, not with the line before.
        """
        bridge = self._bench.lcr_meter
        self._bench.perform(connect, *beside)
        if bridge.read_by_hand:
            self._verifier.verify(connect, lambda: Check(WiringOutcome.UNVERIFIED, "lcr_meter", reason="by hand"))
            return None
        if frequency > _NEARLY_DIRECT:
            low = self._verifier.lines.bridge_frequency or _LOW
            try:
                bridge.configure(low, level, aperture)
            except SetpointError:
                # A bridge without such a frequency tells a path from none all the same.
                check = self._verifier.verify(connect, lambda: bridge_evidence.judged(connect, self._read(), None))
            else:
                check = self._verifier.verify(connect, lambda: self._compared_with_others(connect))
                bridge.configure(frequency, level, aperture)
        else:
            check = self._verifier.verify(connect, lambda: bridge_evidence.judged(connect, self._read(), self._known()))
        return check.read.get("resistance")

    def lines_to_repeat(self, lines: Mapping[LinePair, float]) -> tuple[LinePair, ...]:
        """Return which of the readings (Ω) of AB, BC, CA are to be taken again, their connection being corrected; none if all fit."""
        return self._verifier.lines_to_repeat(
            {pair: meter_across(*pair) for pair in lines},
            [bridge_evidence.compared(list(lines.values()), k) for k in range(len(lines))],
        )

    def _known(self) -> Reference | None:
        return self._verifier.lines.for_bridge(self._verifier.known)

    def _compared_with_others(self, connect: Connect) -> Check:
        lines = self._verifier.lines
        reference = self._known() or lines.supposed_for_bridge()
        reading = self._read()
        check = bridge_evidence.judged(connect, reading, reference)
        if reference is None and reading is not None:
            lines.suppose("lcr_meter", poles_of(connect), bridge_evidence.like(reading))
        return check

    def _read(self) -> ImpedanceReading | None:
        return bridge_evidence.read(self._bench.lcr_meter)
