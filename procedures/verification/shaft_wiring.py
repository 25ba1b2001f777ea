"""Open terminals and the probes on them, verified by the voltage of a slowly turned shaft."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces.text import text
from procedures.core.actions import ALL_OPEN, ConnectProbes, Terminal, VoltageProbe, Wanted
from procedures.estimation.emf.probed_phases import LEAST_STEPS, Pattern, ProbingFault, fitting, patterns, phasors
from procedures.estimation.winding.wiring import WiringOutcome
from procedures.techniques.shaft.driven_shaft import DrivenRecord, expected_peak, record_driven
from procedures.verification.check import Check
from procedures.verification.verifier import VerifiedWiring

#: Of the voltage that the plate lets expect, less than this share is none.
_NONE = 0.03
#: A channel at about this share of the others, in its own phase, is no silent one: a probe of ten to one on a channel set to one, or so.
_TENTH, _ABOUT = 0.1, 0.02
#: The reason of a check that verified the connection and found the phases in the other order.
SEQUENCE = "sequence"


class ShaftWiring(VerifiedWiring):
    """Connections of a motor that is turned from outside."""

    def open_terminals(self, *beside: Wanted) -> None:
        """Open the terminals and make the other requested changes of the setup.

        That is verified where they were so before and nothing was touched since.
        """
        state = self._bench.state
        unchanged = state.verified and state.connection == ALL_OPEN
        self._bench.perform(ALL_OPEN, *beside)
        check = Check(WiringOutcome.VERIFIED, "", reason="unchanged")
        if not unchanged:
            check = Check(WiringOutcome.UNVERIFIED, "", reason="no instrument")
        self._verifier.verify(ALL_OPEN, lambda: check)

    def connect_probes(self, probes: Sequence[VoltageProbe], *, report_order: bool = True) -> None:
        """Fit voltage probes to the open terminals of a motor on the dynamometer, and verify them by turning the shaft slowly.

        Phases in the order A, C, B are a warning where `report_order` is set.
        """
        action = ConnectProbes(tuple(probes))
        self._bench.perform(action)
        check = self._verifier.verify(ALL_OPEN, lambda: self._turned(probes), action)
        if report_order and check.reason == SEQUENCE:
            self._verifier.notice(
                "phase-order",
                text(
                    "with the dynamometer turning forwards the phases follow each other as A, C, B: two channels or two "
                    "wires are interchanged, or the motor's forward direction is the opposite one. The results of this "
                    "procedure do not depend on it, the direction of rotation under a controller does"
                ),
                None,
            )

    def _turned(self, probes: Sequence[VoltageProbe]) -> Check:
        bench = self._bench
        if bench.dynamometer.read_by_hand or bench.oscilloscope.read_by_hand:
            return Check(WiringOutcome.UNVERIFIED, "oscilloscope", reason="by hand")
        plate, share = self._verifier.nameplate, self._verifier.settings.wiring_speed_share
        pole_pairs = self._verifier.known.get("pole_pairs")
        channels = [probe.channel for probe in probes]
        record = record_driven(bench, plate, channels, share, pole_pairs.value if pole_pairs else None)
        check = _judged(probes, record, expected_peak(plate, share))
        if check.outcome is WiringOutcome.WRONG:
            # Hands are going to correct it.
            bench.dynamometer.stop()
        return check


def _judged(probes: Sequence[VoltageProbe], record: DrivenRecord, expected: float | None) -> Check:
    seen = phasors(record.voltages)
    sizes = {f"channel_{probe.channel}": float(abs(size)) for probe, size in zip(probes, seen, strict=True)}
    evidence = text("at low speed the channels show {volts} V, peak", volts=[f"{size:.3g}" for size in sizes.values()])
    largest, least = max(sizes.values()), LEAST_STEPS * record.resolution
    if largest < least:
        if expected is None or largest > _NONE * expected or least > expected:
            return Check(WiringOutcome.UNVERIFIED, "oscilloscope", read=sizes, reason="weak")
        silent = tuple({"kind": ProbingFault.SILENT.value, "channel": probe.channel} for probe in probes)
        turning = {"kind": "no voltage"}
        return Check(
            WiringOutcome.WRONG, "oscilloscope", silent if len(probes) == 1 else (turning,), sizes, "", evidence
        )
    if len(probes) != len(Terminal):
        return Check(WiringOutcome.UNVERIFIED, "oscilloscope", read=sizes, reason="one probe")
    best = next(iter(fitting(seen, list(patterns()))), None)
    if best is None:
        return Check(WiringOutcome.UNEXPLAINED, "oscilloscope", read=sizes, evidence=evidence)
    if best.fault is ProbingFault.NONE:
        return Check(WiringOutcome.VERIFIED, "oscilloscope", read=sizes)
    finding = (_finding(best, probes, seen),)
    if best.fault is ProbingFault.SEQUENCE:
        return Check(WiringOutcome.VERIFIED, "oscilloscope", finding, sizes, SEQUENCE, evidence)
    return Check(WiringOutcome.WRONG, "oscilloscope", finding, sizes, "", evidence)


def _shows_a_tenth(silent: Pattern, seen: NDArray[np.complex128]) -> bool:
    """Return whether the channel taken for a silent one shows its own phase, at about a tenth of what it should."""
    right = np.array(next(patterns()).phasors)
    others = np.array(silent.phasors)
    size = np.vdot(others, seen) / np.vdot(others, others)
    at = silent.channel
    return at is not None and abs(seen[at] / (size * right[at]) - _TENTH) < _ABOUT


def _finding(pattern: Pattern, probes: Sequence[VoltageProbe], seen: NDArray[np.complex128]) -> dict[str, object]:
    record: dict[str, object] = {
        "kind": pattern.fault.value,
        "terminals": [tuple(Terminal)[k].value for k in pattern.terminals],
    }
    if pattern.fault is ProbingFault.SILENT and _shows_a_tenth(pattern, seen):
        record["kind"] = "tenth"
    if pattern.channel is not None:
        record["channel"] = probes[pattern.channel].channel
    return record
