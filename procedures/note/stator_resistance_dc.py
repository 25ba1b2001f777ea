"""Stator resistance by four-wire direct current, where a bridge at 20 Hz cannot do it (erratum E9)."""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, Reading, Regulated
from drivers.interfaces.text import text
from procedures.core.actions import (
    LINE_PAIRS,
    ConnectVoltmeter,
    DoubtReading,
    LinePair,
    LockRotor,
    UncoupleDynamometer,
    label_of,
    supply_across,
)
from procedures.core.bench import Role
from procedures.core.demand import LOOP, Demand, Demands, Measurand
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Cause, Misfit
from procedures.estimation.fitting.repeats import odd_reading
from procedures.estimation.winding import resistance
from procedures.estimation.winding.closing import Unsettled, contacts_made_anew, four_wires_again
from procedures.estimation.winding.resistance import COPPER, COPPER_REFERENCE
from procedures.estimation.winding.settling import unsettled
from procedures.techniques.repeated_readings import READ_SHARE, TYPED_SHARE, between
from procedures.techniques.temperature.correction import check_temperature, warmed, winding_temperature
from procedures.techniques.temperature.settings import (
    COLD,
    CopperCoefficient,
    ReferenceTemperature,
    TemperatureUncertainty,
    WindingTemperature,
)
from procedures.techniques.winding.alignment import flowing_current
from procedures.techniques.winding.closing_reading import allowed_for, closed
from procedures.techniques.winding.four_wire_readings import ratio_limit, scattered
from procedures.techniques.winding.supply_voltage import within_voltage
from procedures.verification.settings import SupplyWiringSettings

#: How often a person is asked about the readings of one polarity.
_QUESTIONS = 5
#: A drift is taken for one beyond so many standard uncertainties.
_CLEAR = 3.0
#: How a line's resistance may differ between a bridge at a low frequency and direct current otherwise than the next line's (relative).
_LINE = 3e-4


class StatorResistanceDcSettings(SupplyWiringSettings):
    """Settings of the four-wire measurement."""

    current_share: float = Field(
        default=0.25, gt=0.0, le=1.0, description="largest current, share of the rated current"
    )
    levels: int = Field(default=4, ge=3, le=50, description="current levels, evenly spaced up to the largest")
    settle: float = Field(default=0.2, gt=0.0, le=60.0, description="time at each level before reading, s")
    power_line_cycles: float = Field(
        default=10.0, ge=0.02, le=100.0, description="voltmeter's integration, power-line cycles"
    )
    closing: bool = Field(default=True, description="read the first two terminals once more at the end")
    heating_limit: float = Field(
        default=1.0, gt=0.0, le=50.0, description="warming of the winding above which a warning is given, K"
    )
    winding_temperature: WindingTemperature = None
    temperature_uncertainty: TemperatureUncertainty = 1.0
    coefficient: CopperCoefficient = COPPER
    reference_temperature: ReferenceTemperature = COPPER_REFERENCE


@dataclass(frozen=True)
class LineSlope:
    """Resistance between two terminals (Ω) from V over I, and the readings behind it: bench time (s), current (A), voltage (V)."""

    resistance: UncertainReal
    readings: tuple[FloatArray, FloatArray, FloatArray]
    misfit: Misfit = NO_MISFIT
    #: By how much V over I changed until the first current had flowed twice as long, and the current between its reading and the voltage's.
    settling: tuple[float, float] | None = None
    #: Standard deviation of one V over I (relative), and how many readings beside the fit's figures show it.
    scatter: tuple[float, int] = (0.0, 0)

    @property
    def rise(self) -> float:
        """The relative rise of V over I from a polarity's first reading to its last, at the same level."""
        _, current, voltage = self.readings
        half = len(current) // 2
        return float(
            np.mean(
                [voltage[k + half - 1] / current[k + half - 1] / (voltage[k] / current[k]) - 1.0 for k in (0, half)]
            )
        )


class StatorResistanceDc(Procedure[StatorResistanceDcSettings]):
    """Stator resistance as the slope of voltage over current, four wires, both polarities (E9)."""

    name: ClassVar[str] = "stator-resistance-dc"
    title: ClassVar[str] = "Stator resistance, four-wire direct current"
    section: ClassVar[str] = "3.2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY, Role.VOLTMETER})
    gives: ClassVar[tuple[str, ...]] = ("stator_resistance",)
    needs: ClassVar[Demands] = {Role.SUPPLY: LOOP, Role.VOLTMETER: Demand((Measurand.VOLTAGE,))}

    _settling: tuple[float, float] | None = None

    def measure(self) -> None:
        """Take the slope between all three pairs of terminals."""
        temperature = self.prepare()
        hottest, pairs = float(temperature.x), LINE_PAIRS
        slopes: dict[LinePair, LineSlope] = {}
        while pairs:
            for pair in pairs:
                slopes[pair] = self.slope(pair)
                hottest = self._check_warming(hottest, slopes[pair].rise)
            pairs = self.wiring.supply.lines_to_repeat({pair: float(s.resistance.x) for pair, s in slopes.items()})
        self.conclude(slopes, temperature, self.close(slopes))

    @step("S1/1", "Lock the shaft, and read the winding's temperature", by_hand=True)
    def prepare(self) -> UncertainReal:
        """Return the temperature (°C) of the winding for the cold resistance."""
        self.bench.perform(LockRotor(), UncoupleDynamometer())
        return winding_temperature(self, self.settings.winding_temperature, self.settings.temperature_uncertainty)

    @step("S1/2", "Between two terminals: several currents, both polarities, voltage inside the clamps", by_hand=True)
    def slope(self, pair: LinePair) -> LineSlope:
        """Return the slope of V over I.

        Both polarities take out thermal voltages; the sign of the current as a further regressor takes out the supply's own offset.
        """
        largest = min(
            self.settings.current_share * self.nameplate.rated_current,
            self.bench.supply.maximum_current,
            self.nameplate.current_bound,
        )
        largest = within_voltage(self, largest)
        levels = largest * np.arange(self.settings.levels, 0, -1) / self.settings.levels
        times: list[float] = []
        currents: list[float] = []
        voltages: list[float] = []
        accuracies: tuple[Accuracy, Accuracy] = (Accuracy(), Accuracy())
        self._settling = None
        high, low = pair
        sensing = ConnectVoltmeter(high, low)
        for sign, plus, minus in ((1.0, high, low), (-1.0, low, high)):
            fed = supply_across(plus, minus)
            self.wiring.supply.four_wires(fed, sensing, ranged=bool(currents))
            # The first level again at the end: a winding that warms or cools shows there.
            read = self._polarity(pair, [*levels, levels[0]], choose_range=not currents)
            accuracies = read[-1][0].accuracy, read[-1][1].accuracy
            times += [voltage.time for _, voltage in read]
            currents += [sign * current.value for current, _ in read]
            voltages += [voltage.value for _, voltage in read]
        i, v = np.array(currents), np.array(voltages)
        half = len(levels) + 1
        self.wiring.supply.both_ways(
            fed, *(float(np.polyfit(i[part], v[part], 1)[0]) for part in (slice(half), slice(half, None)))
        )
        fit = resistance.slope(v, i)
        unc, label = self.bench.uncertainties, label_of(pair)
        quantity = unc.statistical(
            text("slope of V over I, {pair}", pair=label),
            fit.value("resistance"),
            fit.uncertainty("resistance"),
            fit.degrees_of_freedom,
        )
        for name, accuracy in zip(("supply, current", "voltmeter"), accuracies, strict=True):
            quantity = unc.instrument(name, quantity, Accuracy(gain=accuracy.gain, source=accuracy.source))
        misfit = Misfit.together((fit.misfit, scattered(fit, i, accuracies))).of("resistance", "stator_resistance")
        self.tell_misfit(misfit)
        self.findings[label] = {
            "current": currents,
            "voltage": voltages,
            "residual": fit.residuals.tolist(),
            "resistance": fit.value("resistance"),
        }
        steps = (each.resolution / math.sqrt(12.0) for each in accuracies)
        chance = math.hypot(
            fit.residual_rms / abs(v[0]), *(step / abs(x) for step, x in zip(steps, (i[0], v[0]), strict=True))
        )
        return LineSlope(quantity, (np.array(times), i, v), misfit, self._settling, (chance, v.size - 3))

    def close(self, slopes: dict[LinePair, LineSlope]) -> Unsettled:
        """Return what repeated readings of lines show about contacts and about a cooling winding."""
        if not self.settings.closing:
            return Unsettled()
        found = closed(self, lambda pair: four_wires_again(slopes[pair].readings, self.slope(pair).readings))
        return found if found.misfit else self._against_bridge(slopes) or found

    def _against_bridge(self, slopes: dict[LinePair, LineSlope]) -> Unsettled | None:
        """Return contacts that differ from those of the bridge, which has read the same lines in this run; None where none is seen.

        A contact that comes out alike twice shows here only.
        """
        bridge = self.bench.state.lines.by_bridge
        if bridge is None:
            return None
        lines = [float(slopes[pair].resistance.x) for pair in LINE_PAIRS]
        own = max(slopes[pair].scatter[0] for pair in LINE_PAIRS)
        # What the bridge is off by is alike in lines that are alike.
        unlike = bridge.error * (max(lines) - min(lines)) / max(lines)
        scatter = math.hypot(_LINE, own, bridge.scatter, unlike)
        found = contacts_made_anew(bridge.values, lines, scatter, suspected=bridge.contacts > 0.0)
        return found if found.misfit else None

    @step("S1/3", "From line to phase: half the mean for a wye, one and a half for a delta; refer to 25 °C")
    def conclude(self, slopes: dict[LinePair, LineSlope], temperature: UncertainReal, found: Unsettled) -> None:
        """Report the phase's resistance; each phase alone stands in the findings."""
        ab, bc, ca = (slopes[pair].resistance for pair in LINE_PAIRS)
        self.bench.state.lines.read_by_four_wires(
            [float(line.x) for line in (ab, bc, ca)],
            max(3.0 * float(line.u) / float(line.x) for line in (ab, bc, ca)),
            temperature=float(temperature.x),
            contacts=found.contacts,
        )
        phases = resistance.phase_resistances(ab, bc, ca, self.winding)
        self.findings |= {
            "phase_resistances": self.by_winding([float(phase.x) for phase in phases]),
            "winding_temperature": float(temperature.x),
        }
        measured = resistance.from_lines(ab, bc, ca, self.winding)
        at_first = self._at_first_reading([slopes[pair].readings for pair in LINE_PAIRS])
        copper = self.settings.coefficient, self.settings.reference_temperature
        temperature, contacts = allowed_for(self, found, temperature, *copper)
        off, settling = self._unsettled(list(slopes.values()))
        contacts = contacts * self.bench.uncertainties.limit(
            "readings before voltage and current have settled", 1.0, off
        )
        cold = measured.at_temperature(temperature, COLD, *copper)
        self.report(
            "stator_resistance",
            cold.y_equivalent * at_first * contacts,
            section="3.2.2",
            estimator="slope of four-wire voltage over current, both polarities, referred to 25 °C",
            note_value=float(measured.winding.x),
            winding=float((cold.winding * at_first).x) if self.is_delta else None,
            misfit=Misfit.together((found.misfit, settling, *(slopes[pair].misfit for pair in LINE_PAIRS))),
        )

    def _polarity(
        self, pair: LinePair, levels: Sequence[float], *, choose_range: bool
    ) -> list[tuple[Reading, Reading]]:
        """Return current and voltage at each level (A); a reading that contradicts its siblings is taken again, or confirmed."""
        bench = self.bench
        typed = bench.voltmeter.read_by_hand or bench.supply.read_by_hand
        read = [
            self._reading(pair, float(level), choose_range=choose_range and not k) for k, level in enumerate(levels)
        ]
        for _ in range(_QUESTIONS):
            ratios = [voltage.value / current.value for current, voltage in read]
            odd = odd_reading(ratios, TYPED_SHARE if typed else READ_SHARE, ratio_limit(read))
            if odd is None:
                break
            contradiction = text(
                "{terminals}, {voltage:.4g} V at {current:.4g} A: that is {ratio:.4g} Ω, the other currents give {others} Ω",
                terminals=between(pair),
                voltage=read[odd][1].value,
                current=read[odd][0].value,
                ratio=ratios[odd],
                others=[f"{each:.4g}" for k, each in enumerate(ratios) if k != odd],
            )
            if typed and not bench.doubted(DoubtReading(contradiction)):
                break
            read[odd] = self._reading(pair, float(levels[odd]), choose_range=False)
            if not typed:
                message = text(
                    "{contradiction}; the voltage was read again there, and the new reading is used",
                    contradiction=contradiction,
                )
                self.notice(Cause.REPEATS_DIFFER.value, message)
                break
        return read

    def _reading(self, pair: LinePair, level: float, *, choose_range: bool) -> tuple[Reading, Reading]:
        """Return current and voltage at a level (A); raises ProcedureError where it does not flow."""
        bench = self.bench
        with ExitStack() as energised:
            supply = bench.supply
            energised.enter_context(supply.energised(supply.maximum_voltage, level, Regulated.CURRENT))
            begun = bench.clock.now()
            bench.clock.sleep(self.settings.settle)
            current = flowing_current(bench, level)
            # One range for all readings of a pair: each range has a zero and a gain of its own.
            if choose_range:
                output = supply.measure_voltage()
                bench.voltmeter.configure(output.value, self.settings.power_line_cycles)
            voltage = bench.voltmeter.measure_voltage()
            if choose_range:
                self.wiring.supply.seen_leads(output, current, voltage)
                if not (bench.voltmeter.read_by_hand or supply.read_by_hand):
                    self._settling = self._changes(pair, level, (current, voltage), bench.clock.now() - begun)
            return current, voltage

    def _changes(
        self, pair: LinePair, level: float, first: tuple[Reading, Reading], since: float
    ) -> tuple[float, float]:
        """Return by how much (relative) V over I changes until the current has flowed for as long again as `since` (s), and the current
        between its own reading and the voltage's.
        """
        current, voltage = first
        self.bench.clock.sleep(since)
        later = flowing_current(self.bench, level)
        read = [self.bench.voltmeter.measure_voltage().value]
        ratios = [read[0] / later.value / (voltage.value / current.value) - 1.0]
        if abs(ratios[0]) > READ_SHARE:
            # What has not settled differs both times; a wild reading, one of them.
            read.append(self.bench.voltmeter.measure_voltage().value)
            ratios.append(read[1] / later.value / (voltage.value / current.value) - 1.0)
            if abs(ratios[1]) <= READ_SHARE:
                message = text(
                    "{terminals}, {voltage:.4g} V at {current:.4g} A, {before:.4g} V shortly before; the voltage was read again there, and "
                    "the new reading is used",
                    terminals=between(pair),
                    voltage=read[0],
                    current=later.value,
                    before=voltage.value,
                )
                self.notice(Cause.REPEATS_DIFFER.value, message)
        share = (voltage.time - current.time) / (later.time - current.time)
        return ratios[-1], share * (later.value / current.value - 1.0)

    def _unsettled(self, lines: Sequence[LineSlope]) -> tuple[float, Misfit]:
        """Return by how much (relative) the lines may be off because their readings had not settled, and what is said of it."""
        asked = [line for line in lines if line.settling is not None]
        freedom = sum(line.scatter[1] for line in asked)
        square = sum(line.scatter[0] ** 2 for line in asked)
        changes = np.array([line.settling for line in asked]).reshape(-1, 2)
        chance = math.sqrt(square / len(asked)) if asked else 0.0
        off, misfit = unsettled(changes[:, 0], changes[:, 1], chance, freedom)
        self.findings["settling"] = {"changes": changes.tolist(), "allowed": off}
        return off, misfit

    def _check_warming(self, before: float, rise: float) -> float:
        """Return how warm (°C) the winding may be after a pair; raises ProcedureError where that is above the motor's limit.

        What each pair adds is summed up as if nothing cooled meanwhile.
        """
        after = warmed(before, max(rise, 0.0), self.settings.coefficient, self.settings.reference_temperature)
        return check_temperature(self.nameplate, after)

    def _at_first_reading(self, blocks: Sequence[tuple[FloatArray, FloatArray, FloatArray]]) -> UncertainReal | float:
        """Return the resistance at the first reading, when its temperature was known, over the mean: 1 unless it clearly drifted."""
        fit = resistance.drift(blocks)
        times = np.concatenate([time for time, _, _ in blocks])
        change = fit.value("drift") * float(np.mean(times - times[0]))
        warmer = fit.value("drift") * float(times[-1] - times[0]) / self.settings.coefficient
        self.findings["warming"] = warmer
        if abs(fit.value("drift")) <= _CLEAR * fit.uncertainty("drift"):
            return 1.0
        if abs(warmer) > self.settings.heating_limit:
            self.notice(
                "heating",
                text(
                    "the winding's temperature changed by about {warmer:+.1f} K during the measurement; let it cool, use less "
                    "current, and repeat",
                    warmer=warmer,
                ),
            )
        # What the readings' time decides is known no better than it is large.
        return self.bench.uncertainties.limit("drift of the winding's temperature", 1.0 - change, abs(change))
