"""Open terminals and the probes on them, proved by the voltage of a slowly turned shaft."""

import math
from collections.abc import Sequence

import numpy as np

from drivers.interfaces.text import text
from procedures.core.actions import ALL_OPEN, ConnectProbes, Terminal, VoltageProbe
from procedures.estimation.emf.probed_phases import Fault, Pattern, fitting, patterns, phasors
from procedures.estimation.winding.wiring import Outcome
from procedures.techniques.driven_shaft import driving_speed_rad
from procedures.verification.check import Check
from procedures.verification.steady import alternating
from procedures.verification.verification import Proof

#: Periods of a record, if the pole pairs are what is known of them, and the shortest and longest record (s).
_PERIODS, _SHORTEST, _LONGEST = 4.0, 0.02, 4.0
#: A signal of fewer steps of the converter is too weak to be judged.
_STEPS = 6.0
#: Of the voltage that the plate lets expect, less than this share is none.
_NONE = 0.03
#: Why a connection that is proved is not as it should be: its phases are in the other order.
SEQUENCE = "sequence"


class ShaftWiring:
    """Connections of a motor that is turned from outside."""

    def __init__(self, proof: Proof) -> None:
        self._proof = proof
        self._bench = proof.bench

    def open_terminals(self) -> None:
        """Have the terminals opened where no probe is fitted: they are known to be where that was proved and nothing touched since."""
        standing = self._bench.standing
        unchanged = standing.proved and standing.connection == ALL_OPEN
        self._bench.perform(ALL_OPEN)
        known = (Outcome.PROVED, "unchanged") if unchanged else (Outcome.UNPROVED, "no instrument")
        found = Check(known[0], "", reason=known[1])
        self._proof.verify(ALL_OPEN, lambda: found)

    def probes(self, probes: Sequence[VoltageProbe]) -> None:
        """Fit voltage probes to the open terminals of a motor on the dynamometer, and prove them with a slow turn."""
        if self.sequence(probes).reason == SEQUENCE:
            self._proof.notice(
                "phase-order",
                text(
                    "with the dynamometer turning forwards the phases follow each other as A, C, B: two channels or two wires are "
                    "interchanged, or the motor's forwards is the other way. No figure here depends on it, a controller's direction does"
                ),
            )

    def sequence(self, probes: Sequence[VoltageProbe]) -> Check:
        """Fit and prove the probes likewise; the check's reason is `SEQUENCE` where the phases follow each other backwards."""
        action = ConnectProbes(tuple(probes))
        self._bench.perform(action)
        return self._proof.verify(ALL_OPEN, lambda: self._turned(probes), action)

    def _turned(self, probes: Sequence[VoltageProbe]) -> Check:
        bench = self._bench
        if bench.dynamometer.read_by_hand or not bench.oscilloscope.gives_waveforms:
            return Check(Outcome.UNPROVED, "oscilloscope", reason="by hand")
        share = self._proof.levels.speed_share
        speed = driving_speed_rad(bench, self._proof.nameplate, share)
        wanted = self._expected(share)
        with bench.dynamometer.driving_speed(speed):
            waves = alternating(
                bench, [probe.channel for probe in probes], 1.5 * (wanted or 1.0), self._record_time(speed)
            )
        samples = np.vstack([waves[probe.channel].values for probe in probes])
        step = max(waves[probe.channel].resolution for probe in probes)
        found = _judged(probes, samples, step, wanted)
        if found.outcome is Outcome.WRONG:
            # Hands are going to mend it.
            bench.dynamometer.stop()
        return found

    def _expected(self, share: float) -> float | None:
        """Return about what a phase's peak is at a share of the rated speed, by the plate; None where it names no voltage."""
        rated = self._proof.nameplate.rated_voltage
        return share * rated / math.sqrt(3.0) if rated else None

    def _record_time(self, speed: float) -> float:
        known = self._proof.known.get("pole_pairs")
        pairs = known.value if known else self._proof.nameplate.pole_pairs or 1
        return min(max(_PERIODS * 2.0 * math.pi / (pairs * speed), _SHORTEST), _LONGEST)


def _judged(probes: Sequence[VoltageProbe], samples: np.ndarray, step: float, wanted: float | None) -> Check:
    seen = phasors(samples)
    sizes = {f"channel_{probe.channel}": float(abs(size)) for probe, size in zip(probes, seen, strict=True)}
    largest = max(sizes.values())
    evidence = text("at low speed the channels show {volts} V, peak", volts=[f"{size:.3g}" for size in sizes.values()])
    if largest < _STEPS * step:
        if wanted is None or largest > _NONE * wanted or _STEPS * step > wanted:
            return Check(Outcome.UNPROVED, "oscilloscope", read=sizes, reason="weak")
        silent = tuple({"kind": Fault.SILENT.value, "channel": probe.channel} for probe in probes)
        turning = {"kind": "no voltage"}
        return Check(Outcome.WRONG, "oscilloscope", silent if len(probes) == 1 else (turning,), sizes, "", evidence)
    if len(probes) != len(Terminal):
        return Check(Outcome.UNPROVED, "oscilloscope", read=sizes, reason="one probe")
    best = next(iter(fitting(seen, list(patterns()))), None)
    if best is None:
        return Check(Outcome.UNEXPLAINED, "oscilloscope", read=sizes, evidence=evidence)
    if best.fault is Fault.NONE:
        return Check(Outcome.PROVED, "oscilloscope", read=sizes)
    record = _record(best, probes)
    if best.fault is Fault.SEQUENCE:
        return Check(Outcome.PROVED, "oscilloscope", (record,), sizes, SEQUENCE, evidence)
    return Check(Outcome.WRONG, "oscilloscope", (record,), sizes, "", evidence)


def _record(pattern: Pattern, probes: Sequence[VoltageProbe]) -> dict[str, object]:
    record: dict[str, object] = {
        "kind": pattern.fault.value,
        "terminals": [tuple(Terminal)[k].value for k in pattern.terminals],
    }
    if pattern.channel is not None:
        record["channel"] = probes[pattern.channel].channel
    return record
