"""Stator resistance per phase from the three line-to-line values (§3.2)."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar

from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, Aperture, ImpedanceReading, MeasurementError, SetpointError, Wanted
from drivers.interfaces.text import text
from procedures.core.actions import LINE_PAIRS, LinePair, label_of, meter_across
from procedures.core.bench import Bench, Role
from procedures.core.demand import Demand, Demands, Measurand
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.result import Notice
from procedures.core.steps import step
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.estimation.winding import resistance, unbalance
from procedures.estimation.winding.closing import ReadAgain, Unsettled, read_again
from procedures.estimation.winding.resistance import COPPER, COPPER_REFERENCE, PhaseResistance
from procedures.plausibility.capability import cannot_support, relative_uncertainty, temperature_uncertainty
from procedures.techniques.instrument_choice import InstrumentChoice, choose_for_resistance
from procedures.techniques.repeated_readings import RepeatedQuantity, between, repeated_readings
from procedures.techniques.temperature.correction import winding_temperature
from procedures.techniques.temperature.settings import (
    COLD,
    CopperCoefficient,
    ReferenceTemperature,
    TemperatureUncertainty,
    WindingTemperature,
)
from procedures.techniques.winding.closing_reading import allowed_for, closed
from procedures.techniques.winding.short_correction import short_correct
from procedures.techniques.winding.slow_inductance import UNCHANGED, Slow, slow_resistance
from procedures.verification.settings import WiringSettings

#: The note's own coefficient, per kelvin from 25 °C (§3.2.1, E7).
NOTE_COEFFICIENT = 0.004
#: A display that is read by eye shows three digits at least: its last one over the reading.
_DISPLAY = 0.01


class StatorResistanceSettings(WiringSettings):
    """Settings of §3.2."""

    frequency: float = Field(default=20.0, gt=0.0, le=1e6, description="test frequency, Hz")
    level: float = Field(default=1.0, gt=0.0, le=20.0, description="test level, V rms")
    aperture: Aperture = Field(default=Aperture.LONG, description="measurement time")
    repeats: int = Field(default=3, ge=1, le=100, description="readings a line pair")
    closing: bool = Field(
        default=True,
        description="read the first line pair once more at the end, if there are two or more readings a line pair",
    )
    short_correction: bool = Field(default=True, description="measure and subtract the leads first")
    winding_temperature: WindingTemperature = None
    temperature_uncertainty: TemperatureUncertainty = 1.0
    working_temperature: float = Field(
        default=85.0, ge=-60.0, le=250.0, description="also refer the resistance to this, °C"
    )
    coefficient: CopperCoefficient = COPPER
    reference_temperature: ReferenceTemperature = COPPER_REFERENCE
    requested_uncertainty: float = Field(
        default=0.01, gt=0.0, le=1.0, description="relative standard uncertainty asked for"
    )
    unbalance_limit: float = Field(
        default=0.03, gt=0.0, le=1.0, description="spread of the lines over their mean above which it is reported"
    )


@dataclass(frozen=True)
class LineReadings:
    """Mean reading (Ω) of each line pair with its uncertainty, the bridge's accuracy there, what reading them again showed, and what
    higher frequencies did.
    """

    quantities: dict[LinePair, UncertainReal]
    accuracies: dict[LinePair, Accuracy]
    unsettled: Unsettled
    slow: Slow = UNCHANGED

    @property
    def values(self) -> dict[LinePair, float]:
        """The mean readings (Ω)."""
        return {pair: float(quantity.x) for pair, quantity in self.quantities.items()}

    @property
    def largest_error(self) -> float:
        """The bridge's limit of error over the reading, the largest of the three."""
        return max(a.gain + a.offset / self.values[pair] for pair, a in self.accuracies.items())


class StatorResistance(Procedure[StatorResistanceSettings]):
    """Stator resistance per phase from the three line-to-line values (§3.2)."""

    name: ClassVar[str] = "stator-resistance"
    title: ClassVar[str] = "Stator resistance"
    section: ClassVar[str] = "3.2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.LCR_METER})
    gives: ClassVar[tuple[str, ...]] = ("stator_resistance",)
    needs: ClassVar[Demands] = {Role.LCR_METER: Demand((Measurand.RESISTANCE,))}

    @classmethod
    def check_capability(
        cls, bench: Bench, nameplate: Nameplate, settings: StatorResistanceSettings
    ) -> Sequence[Notice]:
        """Compare the bridge's accuracy at the type value with the requested uncertainty (E9)."""
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
        phase = self.to_phase(lines)
        self.refer_to_temperature(lines, phase)

    @step("3.2.2/1", "Choose the instrument: above 2 Ω an RLC meter will do, below it a precision bridge")
    def choose_instrument(self) -> None:
        """Choose by the type value, or by what was measured before; the readings then say whether that was right."""
        identity = self.bench.lcr_meter.identity
        self.findings["instrument"] = f"{identity.manufacturer} {identity.model} {identity.serial_number}".strip()
        expected = self.known_value("stator_resistance") or self.nameplate.expected.get("stator_resistance")
        self._choose(None if expected is None else 2.0 * expected)

    def _choose(self, reading: float | None) -> InstrumentChoice:
        """Choose for a line resistance (Ω), None where it is not known yet."""
        settings, share = self.settings, None
        if reading is not None:
            # A meter that states no accuracy there has none to be chosen by.
            with suppress(MeasurementError, SetpointError):
                accuracy, _ = self.bench.lcr_meter.accuracy_at(
                    reading, 0.0, settings.frequency, settings.level, settings.aperture
                )
                share = relative_uncertainty(accuracy, reading) or None
        choice = choose_for_resistance(self.bench, reading, share, settings.requested_uncertainty)
        self.findings["instrument_choice"] = choice.as_finding()
        return choice

    @step("3.2.2/2", "Set the bridge to {frequency:g} Hz, series inductance and resistance")
    def set_bridge(self) -> None:
        """Set frequency, level and time, and take the leads' own resistance out."""
        bridge, settings = self.bench.lcr_meter, self.settings
        bridge.configure(settings.frequency, settings.level, settings.aperture)
        if settings.short_correction:
            short_correct(self.bench, bridge)

    @step("3.2.2/3", "Measure the three line resistances: AB, BC, CA", by_hand=True)
    def measure_lines(self) -> LineReadings:
        """Return the three line-to-line readings (Ω)."""
        settings, pairs = self.settings, LINE_PAIRS
        readings: dict[LinePair, list[ImpedanceReading]] = {}
        while pairs:
            for pair in pairs:
                readings[pair] = self._read(pair)
            means = {pair: mean_of_readings([r.resistance for r in read]) for pair, read in readings.items()}
            pairs = self.wiring.bridge.lines_to_repeat({pair: mean for pair, (mean, _, _) in means.items()})
        accuracies = {pair: read[-1].resistance_accuracy for pair, read in readings.items()}
        quantities = {pair: self._line(pair, means[pair], accuracies[pair]) for pair in LINE_PAIRS}
        unsettled = self._close(readings)
        # The last line is still connected.
        at = settings.frequency, settings.level, settings.aperture
        slow = slow_resistance(self, *at, self.gives, [read[-1].inductance for read in readings.values()])
        lines = LineReadings(quantities, accuracies, unsettled, slow)
        scatter = math.hypot(slow.unlike, max(uncertainty / mean for mean, uncertainty, _ in means.values()))
        # A direct current reads less than the bridge by what losses take.
        read = tuple(lines.values.values()), lines.largest_error + slow.most, settings.frequency, scatter
        self.bench.state.lines.read_by_bridge(*read, contacts=lines.unsettled.contacts)
        return lines

    def _read(self, pair: LinePair) -> list[ImpedanceReading]:
        settings = self.settings
        self.wiring.bridge.connect(meter_across(*pair), settings.frequency, settings.level, settings.aperture)
        return repeated_readings(self, RepeatedQuantity(between(pair), Wanted.RESISTANCE, self.gives), settings.repeats)

    def _close(self, readings: dict[LinePair, list[ImpedanceReading]]) -> Unsettled:
        """Return what repeated readings of lines show about contacts and about a cooling winding."""
        if not self.settings.closing or self.settings.repeats < 2:
            return Unsettled()
        values = {pair: [r.resistance for r in read] for pair, read in readings.items()}

        def again(pair: LinePair) -> ReadAgain:
            first, last = readings[pair], self._read(pair)
            digits = _DISPLAY if self.bench.lcr_meter.read_by_hand else 0.0
            resolution = max(digits, last[-1].resistance_accuracy.resolution / abs(last[-1].resistance))
            return read_again(
                values[pair],
                [r.resistance for r in last],
                [values[other] for other in LINE_PAIRS if other != pair],
                seconds=last[-1].time - first[-1].time,
                coarseness=resolution / math.sqrt(12.0),
            )

        return closed(self, again)

    def _line(self, pair: LinePair, mean: tuple[float, float, float], accuracy: Accuracy) -> UncertainReal:
        unc = self.bench.uncertainties
        return unc.instrument(
            "LCR meter", unc.statistical(text("repeats of {what}", what=f"R_{label_of(pair)}"), *mean), accuracy
        )

    @step("3.2.2/4", "From line to phase: half the mean reading for a wye, one and a half for a delta")
    def to_phase(self, lines: LineReadings) -> PhaseResistance[UncertainReal]:
        """Return the winding's and the Y-equivalent's resistance; the three readings also give each phase alone."""
        ab, bc, ca = lines.values.values()
        choice = self._choose((ab + bc + ca) / 3.0)
        # What it cannot do by its stated accuracy E9 says below.
        if choice.unstated:
            self.notice("instrument-choice", choice.sentence())
        spread = unbalance.spread((ab, bc, ca))
        self.findings |= {
            "line_resistances": {"AB": ab, "BC": bc, "CA": ca},
            "phase_resistances": self.by_winding(resistance.phase_resistances(ab, bc, ca, self.winding)),
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
        if self.is_delta:
            self.notice(
                "E8",
                text(
                    "delta: 1.5 times the reading is the resistance of one winding; a controller wants the Y-equivalent, "
                    "half the reading. Both are given"
                ),
            )
        in_ab, in_bc, in_ca = lines.quantities.values()
        return resistance.from_lines(in_ab, in_bc, in_ca, self.winding)

    @step("3.2.1/1", "Refer the resistance to 25 °C, and to {working_temperature:g} °C")
    def refer_to_temperature(self, lines: LineReadings, phase: PhaseResistance[UncertainReal]) -> None:
        """Report the cold value at 25 °C with the winding's temperature in its budget."""
        settings, copper = self.settings, (self.settings.coefficient, self.settings.reference_temperature)
        temperature = winding_temperature(self, settings.winding_temperature, settings.temperature_uncertainty)
        temperature, contacts = allowed_for(self, lines.unsettled, temperature, *copper)
        cold = phase.at_temperature(temperature, COLD, *copper)
        working = cold.at_temperature(COLD, settings.working_temperature, *copper)
        self.findings |= {
            "winding_temperature": float(temperature.x),
            "at_working_temperature": {
                "temperature": settings.working_temperature,
                "value": float(working.y_equivalent.x) * float(lines.slow.ratio.x),
            },
            "instrument_share": lines.largest_error,
        }
        if float(temperature.x) != COLD and copper == (NOTE_COEFFICIENT, COLD):
            self.notice(
                "E7",
                text(
                    "the note's coefficient 0.004 /K at 25 °C is not copper's, which is 0.00385 /K there (0.00393 /K at 20 °C)"
                ),
            )
        self.report(
            "stator_resistance",
            cold.y_equivalent * contacts * lines.slow.ratio,
            section="3.2.2",
            estimator="mean of three line resistances, referred to 25 °C by copper's coefficient",
            note_value=float(phase.winding.x),
            winding=float(cold.winding.x) * float(lines.slow.ratio.x) if self.is_delta else None,
            misfit=Misfit.together((lines.unsettled.misfit, lines.slow.misfit)),
        )
        relative = float(cold.y_equivalent.u) / float(cold.y_equivalent.x)
        if relative > settings.requested_uncertainty:
            self.notice(
                "E9",
                text(
                    "the bridge's own error at {frequency:g} Hz is up to {share:.1%} of these readings, so the resistance is known "
                    "to {relative:.1%} and not to the {requested:.1%} asked for; a four-wire direct-current measurement does better",
                    frequency=settings.frequency,
                    share=lines.largest_error,
                    relative=relative,
                    requested=settings.requested_uncertainty,
                ),
            )
