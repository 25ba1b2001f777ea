"""Stator resistance per phase from the three line-to-line values (§3.2)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, Aperture, ImpedanceReading, Wanted
from drivers.interfaces.text import text
from procedures.core.actions import LINE_PAIRS, SeparateMeterLeads, ShortMeterLeads, Terminal, meter_across
from procedures.core.bench import Bench, Role
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.result import Notice
from procedures.core.steps import step
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.estimation.winding import resistance
from procedures.plausibility.capability import cannot_support, relative_uncertainty, temperature_uncertainty
from procedures.techniques.temperature_correction import copper_factor, winding_temperature
from procedures.techniques.temperature_settings import (
    COLD,
    CopperCoefficient,
    ReferenceTemperature,
    TemperatureUncertainty,
    WindingTemperature,
)
from procedures.verification.settings import WiringSettings

Pair = tuple[Terminal, Terminal]

#: The note's own coefficient, per kelvin from 25 °C (§3.2.1, E7).
NOTE_COEFFICIENT = 0.004


class StatorResistanceSettings(WiringSettings):
    """Settings of §3.2."""

    frequency: float = Field(default=20.0, gt=0.0, le=1e6, description="test frequency, Hz")
    level: float = Field(default=1.0, gt=0.0, le=20.0, description="test level, V rms")
    aperture: Aperture = Field(default=Aperture.LONG, description="measurement time")
    repeats: int = Field(default=3, ge=1, le=100, description="readings a line pair")
    short_correction: bool = Field(default=True, description="measure and subtract the leads first")
    winding_temperature: WindingTemperature = None
    temperature_uncertainty: TemperatureUncertainty = 1.0
    working_temperature: float = Field(
        default=85.0, ge=-60.0, le=250.0, description="also refer the resistance to this, °C"
    )
    coefficient: CopperCoefficient = 0.00393
    reference_temperature: ReferenceTemperature = 20.0
    requested_uncertainty: float = Field(
        default=0.01, gt=0.0, le=1.0, description="relative standard uncertainty asked for"
    )
    unbalance_limit: float = Field(
        default=0.03, gt=0.0, le=1.0, description="spread of the lines over their mean that is a finding"
    )


@dataclass(frozen=True)
class LineReadings:
    """Mean reading (Ω) of each line pair with its statistics, and the bridge's accuracy there."""

    values: dict[Pair, float]
    quantities: dict[Pair, UncertainReal]
    accuracies: dict[Pair, Accuracy]


class StatorResistance(Procedure[StatorResistanceSettings]):
    """Stator resistance per phase from the three line-to-line values (§3.2)."""

    name: ClassVar[str] = "stator-resistance"
    title: ClassVar[str] = "Stator resistance"
    section: ClassVar[str] = "3.2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.LCR_METER})
    gives: ClassVar[tuple[str, ...]] = ("stator_resistance",)

    @classmethod
    def foresee(cls, bench: Bench, nameplate: Nameplate, settings: StatorResistanceSettings) -> Sequence[Notice]:
        """Hold the bridge's accuracy at the type value against the uncertainty asked for (E9)."""
        expected = nameplate.expected.get("stator_resistance")
        if expected is None:
            return ()
        line = 2.0 * expected
        inductance = sum(nameplate.expected.get(f"{axis}_axis_inductance", 0.0) for axis in "dq")
        bridge = bench.lcr_meter
        accuracy, _ = bridge.accuracy_at(line, inductance, settings.frequency, settings.level, settings.aperture)
        warm = temperature_uncertainty(
            settings.temperature_uncertainty, settings.coefficient, settings.reference_temperature, COLD
        )
        gives = math.hypot(relative_uncertainty(accuracy, line), warm)
        if gives <= settings.requested_uncertainty:
            return ()
        if warm > settings.requested_uncertainty:
            remedy = text(
                "the winding's temperature would have to be known within ±{half_width:.2g} K",
                half_width=settings.temperature_uncertainty * settings.requested_uncertainty / warm,
            )
        elif bench.has(Role.SUPPLY) and bench.has(Role.VOLTMETER):
            remedy = text("measure by four-wire direct current instead: stator-resistance-dc")
        else:
            remedy = text(
                "measure by four-wire direct current instead: stator-resistance-dc, for which the station lacks supply or voltmeter"
            )
        conditions = text(
            "({model}) at {frequency:g} Hz on {value:.3g} mΩ between lines",
            model=bridge.identity.model,
            frequency=settings.frequency,
            value=1e3 * line,
        )
        return (
            cannot_support(
                cls.name, Role.LCR_METER, conditions, gives=gives, asked=settings.requested_uncertainty, remedy=remedy
            ),
        )

    def measure(self) -> None:
        """Measure AB, BC and CA, and refer the phase value to 25 °C."""
        self.choose_instrument()
        self.set_bridge()
        lines = self.measure_lines()
        winding, y_equivalent = self.to_phase(lines)
        self.refer_to_temperature(lines, winding, y_equivalent)

    @step("3.2.2/1", "Choose the instrument: above 2 Ω an RLC meter will do, below it a precision bridge")
    def choose_instrument(self) -> None:
        """Record which meter it is; the budget shows whether it was good enough."""
        identity = self.bench.lcr_meter.identity
        self.findings["instrument"] = f"{identity.manufacturer} {identity.model} {identity.serial_number}".strip()

    @step("3.2.2/2", "Set the bridge to {frequency:g} Hz, series inductance and resistance")
    def set_bridge(self) -> None:
        """Set frequency, level and time, and take the leads' own resistance out."""
        bridge = self.bench.lcr_meter
        bridge.configure(self.settings.frequency, self.settings.level, self.settings.aperture)
        if self.settings.short_correction:
            self.bench.perform(ShortMeterLeads())
            bridge.correct_short()
            self.bench.perform(SeparateMeterLeads())

    @step("3.2.2/3", "Measure the three line resistances: AB, BC, CA", by_hand=True)
    def measure_lines(self) -> LineReadings:
        """Return the three line-to-line readings (Ω)."""
        readings = {pair: self._line(pair) for pair in LINE_PAIRS}

        def read_again(number: int) -> None:
            readings[LINE_PAIRS[number]] = self._line(LINE_PAIRS[number])

        self.wiring.bridge.compare_lines(
            [meter_across(*pair) for pair in LINE_PAIRS],
            lambda: [mean_of_readings([r.resistance for r in read])[0] for read in readings.values()],
            read_again,
        )
        values: dict[Pair, float] = {}
        quantities: dict[Pair, UncertainReal] = {}
        accuracies: dict[Pair, Accuracy] = {}
        for pair, read in readings.items():
            mean, uncertainty, freedom = mean_of_readings([r.resistance for r in read])
            label = pair[0].value + pair[1].value
            statistics = self.bench.uncertainties.statistical(f"repeats of R_{label}", mean, uncertainty, freedom)
            values[pair] = mean
            accuracies[pair] = read[-1].resistance_accuracy
            quantities[pair] = self.bench.uncertainties.instrument("LCR meter", statistics, accuracies[pair])
        error = max(a.gain + a.offset / values[pair] for pair, a in accuracies.items())
        self.bench.standing.lines.read_by_bridge(list(values.values()), error, self.settings.frequency)
        return LineReadings(values, quantities, accuracies)

    def _line(self, pair: Pair) -> list[ImpedanceReading]:
        first = self.wiring.bridge.line(meter_across(*pair), self.settings.frequency)
        rest = [self.bench.lcr_meter.measure(Wanted.RESISTANCE) for _ in range(self.settings.repeats - 1)]
        return [first, *rest]

    @step("3.2.2/4", "From line to phase: half the mean reading for a wye, one and a half for a delta")
    def to_phase(self, lines: LineReadings) -> tuple[UncertainReal, UncertainReal]:
        """Return the winding's and the Y-equivalent's resistance; the three readings also give each phase alone."""
        ab, bc, ca = (lines.values[pair] for pair in LINE_PAIRS)
        phases = resistance.phase_resistances(ab, bc, ca, self.winding)
        spread = (max(ab, bc, ca) - min(ab, bc, ca)) / ((ab + bc + ca) / 3.0)
        self.findings |= {
            "line_resistances": {"AB": ab, "BC": bc, "CA": ca},
            "phase_resistances": dict(
                zip(("AB", "BC", "CA") if self.is_delta else ("A", "B", "C"), phases, strict=True)
            ),
            "unbalance": spread,
        }
        if spread > self.settings.unbalance_limit:
            self.notice(
                "unbalance",
                text(
                    "the three line resistances differ by {spread:.1%} of their mean: one resistance does not describe this motor; "
                    "look at the phases' own values, and at contacts and solder joints",
                    spread=spread,
                ),
            )
        mean = sum((lines.quantities[pair] for pair in LINE_PAIRS), 0.0) / 3.0
        if self.is_delta:
            self.notice(
                "E8",
                text(
                    "delta: 1.5 times the reading is the resistance of one winding; a controller wants the Y-equivalent, "
                    "half the reading. Both are given"
                ),
            )
        return (1.5 if self.is_delta else 0.5) * mean, 0.5 * mean

    @step("3.2.1/1", "Refer the resistance to 25 °C, and to {working_temperature:g} °C")
    def refer_to_temperature(self, lines: LineReadings, winding: UncertainReal, y_equivalent: UncertainReal) -> None:
        """Report the cold value at 25 °C with the winding's temperature in its budget."""
        temperature = winding_temperature(
            self.bench, self.nameplate, self.settings.winding_temperature, self.settings.temperature_uncertainty
        )
        measured_at = float(temperature.x)
        copper = (self.settings.coefficient, self.settings.reference_temperature)
        cold = y_equivalent * copper_factor(temperature, COLD, *copper)
        winding_cold = winding * copper_factor(temperature, COLD, *copper)
        warm = cold * copper_factor(COLD, self.settings.working_temperature, *copper)
        accuracy = max((a.gain + a.offset / lines.values[p] for p, a in lines.accuracies.items()), default=0.0)
        self.findings |= {
            "winding_temperature": measured_at,
            "at_working_temperature": {"temperature": self.settings.working_temperature, "value": float(warm.x)},
            "instrument_share": accuracy,
        }
        if measured_at != 25.0 and (self.settings.coefficient, self.settings.reference_temperature) == (
            NOTE_COEFFICIENT,
            25.0,
        ):
            self.notice(
                "E7",
                text(
                    "the note's coefficient 0.004 /K at 25 °C is not copper's, which is 0.00385 /K there (0.00393 /K at 20 °C)"
                ),
            )
        simple = float((winding if self.is_delta else y_equivalent).x)
        parameter = self.report(
            "stator_resistance",
            "Ω",
            cold,
            section="3.2.2",
            estimator="mean of three line resistances, referred to 25 °C by copper's coefficient",
            note_value=simple,
            convention="per phase of the Y-equivalent, at 25 °C",
            winding=float(winding_cold.x) if self.is_delta else None,
        )
        relative = parameter.standard_uncertainty / parameter.value
        if relative > self.settings.requested_uncertainty:
            self.notice(
                "E9",
                text(
                    "the bridge's own error at {frequency:g} Hz is up to {share:.1%} of these readings, so the resistance is known "
                    "to {relative:.1%} and not to the {requested:.1%} asked for; a four-wire direct-current measurement does better",
                    frequency=self.settings.frequency,
                    share=accuracy,
                    relative=relative,
                    requested=self.settings.requested_uncertainty,
                ),
            )
