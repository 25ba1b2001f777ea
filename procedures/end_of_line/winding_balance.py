"""Balance of the windings: how far a line's resistance or inductance is from the mean of the three."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, Aperture, ImpedanceReading, Wanted
from drivers.interfaces.text import text
from procedures.core.actions import (
    LINE_PAIRS,
    LinePair,
    LockRotor,
    UncoupleDynamometer,
    label_of,
    meter_across,
)
from procedures.core.bench import Role
from procedures.core.demand import Demand, Demands, Measurand
from procedures.core.procedure import Procedure
from procedures.core.procedure_error import ProcedureError
from procedures.core.steps import step
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding import resistance
from procedures.estimation.winding.closing import ReadAgain, Unsettled, read_again
from procedures.estimation.winding.unbalance import all_at_once, largest_deviation, pooled, saliency_share
from procedures.estimation.winding.wiring import Kind
from procedures.techniques.repeated_readings import RepeatedQuantity, between, repeated_readings
from procedures.techniques.winding.closing_reading import closed
from procedures.techniques.winding.short_correction import short_correct
from procedures.verification.settings import WiringSettings
from procedures.verification.verifier import WiringError

_AXES = ("d_axis_inductance", "q_axis_inductance")
_PER_CENT = 100.0
_RESISTANCE = "resistance_unbalance"
#: Figures that are there only where other instruments had a path through every lead of the motor.
_AT_ALL_LEADS = ("back_emf_unbalance", "stator_resistance")


class WindingBalanceSettings(WiringSettings):
    """Settings of the balance of the windings."""

    resistance_frequency: float = Field(default=20.0, gt=0.0, le=1e6, description="test frequency for resistance, Hz")
    inductance_frequency: float = Field(default=1000.0, gt=0.0, le=1e6, description="test frequency for inductance, Hz")
    level: float = Field(default=1.0, gt=0.0, le=20.0, description="test level, V rms")
    aperture: Aperture = Field(default=Aperture.MEDIUM, description="measurement time")
    repeats: int = Field(default=2, ge=1, le=100, description="readings a line")
    closing: bool = Field(
        default=True,
        description="read the first line, and the one that differs most, once more at the end, if there are two or more readings a line",
    )
    short_correction: bool = Field(
        default=True, description="measure and subtract the leads first; once for a series of motors is enough"
    )


@dataclass(frozen=True)
class LineQuantity:
    """One quantity between AB, BC and CA: all readings, the bridge's accuracy there, and what reading a line again showed."""

    readings: Sequence[Sequence[float]]
    accuracies: Sequence[Accuracy]
    unsettled: Unsettled = field(default_factory=Unsettled)


class WindingBalance(Procedure[WindingBalanceSettings]):
    """Largest deviation of the three line resistances and inductances from their mean, in per cent of it.

    Its form is that of voltage unbalance (NEMA MG 1). The bridge's gain and zero are the same in three like readings, so that
    a difference is known much better than a value.
    """

    name: ClassVar[str] = "winding-balance"
    title: ClassVar[str] = "Balance of the windings"
    section: ClassVar[str] = "L1"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.LCR_METER})
    gives: ClassVar[tuple[str, ...]] = ("resistance_unbalance", "inductance_unbalance")
    needs: ClassVar[Demands] = {Role.LCR_METER: Demand((Measurand.RESISTANCE, Measurand.INDUCTANCE))}
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Read the three lines, and compare them."""
        self.prepare()
        resistances, inductances = self.read_lines()
        self.compare_resistances(resistances)
        self.compare_inductances(inductances)

    @step("L1/1", "Lock the shaft, and take the leads out of the bridge's readings", by_hand=True)
    def prepare(self) -> None:
        """Lock the shaft, because the inductances change with its position."""
        bridge, settings = self.bench.lcr_meter, self.settings
        self.bench.perform(UncoupleDynamometer(), LockRotor())
        if settings.short_correction:
            bridge.configure(settings.inductance_frequency, settings.level, settings.aperture)
            short_correct(self.bench, bridge)

    @step(
        "L1/2",
        "Between AB, BC and CA: resistance at {resistance_frequency:g} Hz, inductance at {inductance_frequency:g} Hz",
        by_hand=True,
    )
    def read_lines(self) -> tuple[LineQuantity, LineQuantity]:
        """Return resistances (Ω) and inductances (H), each line connected once."""
        bridge, settings = self.bench.lcr_meter, self.settings
        count = 1 if bridge.read_by_hand else settings.repeats
        by_resistance, by_inductance = [], []
        #: Lines that do not conduct: which terminal they have in common tells the lead.
        dead: dict[LinePair, WiringError] = {}
        for pair in LINE_PAIRS:
            at = (settings.resistance_frequency, settings.level, settings.aperture)
            bridge.configure(*at)
            try:
                self.wiring.bridge.connect(meter_across(*pair), *at)
            except WiringError as error:
                dead[pair] = error
                continue
            if dead:
                continue
            line = RepeatedQuantity(between(pair), Wanted.RESISTANCE, (_RESISTANCE,))
            by_resistance.append(repeated_readings(self, line, count))
            bridge.configure(settings.inductance_frequency, settings.level, settings.aperture)
            line = RepeatedQuantity(between(pair), Wanted.INDUCTANCE, ("inductance_unbalance",))
            by_inductance.append(repeated_readings(self, line, count))
        if dead:
            raise self._bridge_off(dead) or _open_lead(dead)
        return (
            LineQuantity(
                [[r.resistance for r in read] for read in by_resistance],
                [r[0].resistance_accuracy for r in by_resistance],
                self._close(dict(zip(LINE_PAIRS, by_resistance, strict=True)), count),
            ),
            LineQuantity(
                [[r.inductance for r in read] for read in by_inductance],
                [r[0].inductance_accuracy for r in by_inductance],
            ),
        )

    def _close(self, readings: Mapping[LinePair, Sequence[ImpedanceReading]], count: int) -> Unsettled:
        """Return what reading a line again shows of contacts: each line is connected once, and a contact that adds looks unbalanced."""
        bridge, settings = self.bench.lcr_meter, self.settings
        if not settings.closing or count < 2:
            return Unsettled()
        at = (settings.resistance_frequency, settings.level, settings.aperture)
        values = {pair: [r.resistance for r in read] for pair, read in readings.items()}

        def again(pair: LinePair) -> ReadAgain:
            bridge.configure(*at)
            self.wiring.bridge.connect(meter_across(*pair), *at)
            line = RepeatedQuantity(between(pair), Wanted.RESISTANCE, (_RESISTANCE,))
            last = repeated_readings(self, line, count)
            return read_again(
                values[pair],
                [r.resistance for r in last],
                [values[other] for other in LINE_PAIRS if other != pair],
                seconds=last[-1].time - readings[pair][0].time,
                coarseness=last[-1].resistance_accuracy.resolution / abs(last[-1].resistance) / math.sqrt(12.0),
            )

        # A bad contact is most likely in the line that differs most.
        farthest = LINE_PAIRS[largest_deviation([sum(read) / len(read) for read in values.values()]).place]
        return closed(self, again, _RESISTANCE, farthest)

    def _bridge_off(self, dead: Mapping[LinePair, WiringError]) -> ProcedureError | None:
        """Return that the bridge's own lead is off: no line conducts, and other instruments had all three leads of the motor."""
        measured = next((self.known[name] for name in _AT_ALL_LEADS if name in self.known), None)
        if measured is None or len(dead) < len(LINE_PAIRS):
            return None
        return ProcedureError(
            text(
                "the LCR meter finds no line that conducts, and {name} was measured at the same terminals before: a lead or "
                "a relay of the LCR meter is open",
                name=measured.label,
            )
        )

    @step("L1/3", "Resistance: the largest deviation of a line from the mean of the three, over the mean")
    def compare_resistances(self, lines: LineQuantity) -> None:
        """Report it; the phases' own resistances stand in the findings."""
        values = self._report(_RESISTANCE, "R", "resistance", lines)
        ab, bc, ca = values
        try:
            phases = resistance.phase_resistances(ab, bc, ca, self.winding)
        except EstimationError:
            # One line is more than the other two together, which the deviation itself says.
            return
        self.findings["phase_resistances"] = self.by_winding(phases)

    @step("L1/4", "Inductance: the same; the influence of the rotor's saliency is part of the uncertainty")
    def compare_inductances(self, lines: LineQuantity) -> None:
        """Report it, with the rotor's saliency in the budget where both axes' inductances are known."""
        saliency = self._saliency()
        if saliency is None:
            self.notice(
                "saliency",
                text(
                    "at rest the rotor's saliency also makes the line inductances differ, and it is not known in this "
                    "run: measure the d- and q-axis inductances before, or give both under [expected] in the motor file"
                ),
            )
        self._report("inductance_unbalance", "L", "inductance", lines, _PER_CENT * (saliency or 0.0))

    def _saliency(self) -> float | None:
        d, q = (self.known_value(name) or self.nameplate.expected.get(name) for name in _AXES)
        return saliency_share(d, q) if d and q else None

    def _report(
        self, name: str, symbol: str, quantity: str, lines: LineQuantity, saliency: float = 0.0
    ) -> Sequence[float]:
        """Report the largest deviation in per cent, known no better than ± `saliency` (per cent); return the lines' means."""
        unc, labels = self.bench.uncertainties, [label_of(pair) for pair in LINE_PAIRS]
        found = pooled(lines.readings)
        widened = found.deviation * all_at_once(len(labels), found.degrees_of_freedom)
        means: list[UncertainReal] = []
        for label, mean, readings, accuracy in zip(labels, found.means, lines.readings, lines.accuracies, strict=True):
            own = widened / len(readings) ** 0.5
            statistics = unc.statistical(
                text("repeats of {what}", what=f"{symbol}_{label}"), mean, own, found.degrees_of_freedom
            )
            means.append(unc.instrument("LCR meter", statistics, accuracy))
        farthest = largest_deviation(means)
        size = _PER_CENT * farthest.share
        if saliency:
            size = size + unc.limit("the rotor's saliency", 0.0, saliency)
        unsettled = lines.unsettled
        if unsettled.misfit.findings:
            # A winding that cools differs between lines by what it changed meanwhile, contacts by all that they may add.
            apart = abs(float(unsettled.misfit.findings[0].figures["change"])) if unsettled.warm else unsettled.excess
            size = size + unc.limit("lines that read otherwise again", 0.0, _PER_CENT * apart)
        self.findings[f"line_{quantity}s"] = dict(zip(labels, found.means, strict=True))
        self.findings[f"{name}_line"] = labels[farthest.place]
        self.findings[f"{name}_deviations"] = self._deviations(found.means, labels)
        self.report(
            name,
            size,
            section=self.section,
            estimator="largest deviation of a line from the mean of the three, over the mean",
            misfit=unsettled.misfit,
        )
        return found.means

    def _deviations(self, values: Sequence[float], labels: Sequence[str]) -> dict[str, float]:
        mean = sum(values) / len(values)
        return {label: _PER_CENT * (value / mean - 1.0) for label, value in zip(labels, values, strict=True)}


def _open_lead(dead: Mapping[LinePair, WiringError]) -> WiringError:
    """Return what lines that do not conduct say together: two of them have the lead or phase in common that is open."""
    first = next(iter(dead.values()))
    common = set.intersection(*(set(pair) for pair in dead))
    if len(dead) != len(LINE_PAIRS) - 1 or len(common) != 1:
        return first
    (terminal,) = common
    return WiringError(
        text(
            "lines {lines} do not conduct and the third does: the lead or the phase of {terminal} is open",
            lines=[label_of(pair) for pair in dead],
            terminal=terminal.value,
        ),
        ({"kind": Kind.OPEN.value, "terminals": [terminal.value]},),
    )
