"""All three terminals joined by a link, verified by what the slowly turned motor shows then: a current, and no voltage."""

from collections.abc import Sequence

import numpy as np

from drivers.interfaces import Waveform
from drivers.interfaces.text import text
from procedures.core.actions import ALL_SHORTED, ConnectProbes, CurrentProbe, Terminal, VoltageProbe
from procedures.core.bench import Role
from procedures.estimation.emf.probed_phases import LEAST_STEPS, phasors
from procedures.estimation.winding.wiring import Kind, WiringOutcome
from procedures.techniques.steady_signals import alternating
from procedures.verification.check import Check, without_current
from procedures.verification.verifier import VerifiedWiring

#: Of the EMF at the same speed: a joined terminal shows less against the others' mean, an open one more.
_JOINED, _OPEN = 0.2, 0.5
#: Three open terminals show as much as each other.
_ALIKE = 0.75
#: Periods of a record, the shortest and the longest record (s).
_PERIODS, _SHORTEST, _LONGEST = 4.0, 0.02, 4.0
_BY = Role.OSCILLOSCOPE.value


class ShortedWiring(VerifiedWiring):
    """The short of all three terminals."""

    def joined(
        self,
        voltages: Sequence[VoltageProbe],
        probe: CurrentProbe | None,
        electrical_ratio: float,
        flux: float,
        largest: float,
        speed: float,
    ) -> None:
        """Join all terminals, fit the probes, and verify both by turning the shaft slowly.

        `voltages` are three probes on the phases against the artificial star, `electrical_ratio` the pole pairs, `flux` (V·s/rad) the
        EMF over electrical speed that they showed with open terminals, `largest` (A) a first guess of the current's amplitude,
        `speed` (rad/s) one at which the current is small.
        """
        probes = ConnectProbes((*voltages, *((probe,) if probe else ())))
        bench = self._bench
        bench.perform(ALL_SHORTED, probes)

        def turned() -> Check:
            if bench.dynamometer.read_by_hand or bench.oscilloscope.read_by_hand:
                return Check(WiringOutcome.UNVERIFIED, _BY, reason="by hand")
            emf = flux * electrical_ratio * speed
            record_time = min(max(_PERIODS * 2.0 * np.pi / (electrical_ratio * speed), _SHORTEST), _LONGEST)
            with bench.dynamometer.driving_speed(speed):
                channels = [each.channel for each in voltages]
                seen = alternating(bench, channels, 1.5 * emf, record_time) if channels else {}
                current = alternating(bench, [probe.channel], largest, record_time)[probe.channel] if probe else None
            bench.dynamometer.stop()
            sizes = (
                [float(abs(size)) for size in phasors(np.vstack([seen[c].values for c in channels]))] if seen else []
            )
            return _judged(sizes, current, emf, probe)

        self._verifier.verify(ALL_SHORTED, turned, probes)


def _judged(sizes: Sequence[float], current: Waveform | None, emf: float, probe: CurrentProbe | None) -> Check:
    read = {f"voltage_{t.value}": size for t, size in zip(Terminal, sizes, strict=False)}
    none = False
    if current is not None:
        read["current"] = float(abs(phasors(current.values[np.newaxis, :])[0]))
        none = read["current"] < LEAST_STEPS * current.resolution
    evidence = text(
        "at low speed the terminals show {volts} V against their mean, where the EMF is {emf:.3g} V, peak; the current is {current} A",
        volts=[f"{size:.3g}" for size in sizes],
        emf=emf,
        current=f"{read['current']:.3g}" if current is not None else "–",
    )
    if len(sizes) != len(Terminal):
        return Check(WiringOutcome.UNVERIFIED, _BY, read=read, reason="weak" if none else "link current")
    if max(sizes) > _OPEN * emf and min(sizes) > _ALIKE * max(sizes):
        return Check(WiringOutcome.WRONG, _BY, ({"kind": "not joined"},), read, "", evidence)
    largest = int(np.argmax(sizes))
    if sizes[largest] > _OPEN * emf:
        # Off its own leg a terminal shows twice what the two joined ones do.
        open_wire = {"kind": Kind.OPEN.value, "terminals": [tuple(Terminal)[largest].value]}
        return Check(WiringOutcome.WRONG, _BY, (open_wire,), read, "", evidence)
    if none and probe is not None:
        return Check(WiringOutcome.WRONG, _BY, (without_current(probe),), read, "", evidence)
    if max(sizes) > _JOINED * emf:
        return Check(WiringOutcome.UNEXPLAINED, _BY, read=read, evidence=evidence)
    return Check(WiringOutcome.VERIFIED, _BY, read=read)
