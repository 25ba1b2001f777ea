"""Ld and Lq from the current's response to a voltage step on the locked rotor (§3.3.1)."""

from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, ProbeKind, Slope, Trigger, Waveform
from drivers.interfaces.text import text
from procedures.core.actions import (
    ALIGN_D,
    ALIGN_Q,
    STEP_NEGATIVE,
    STEP_POSITIVE,
    CurrentProbe,
    LockRotor,
    Node,
    ReleaseRotor,
    Terminal,
    UncoupleDynamometer,
    VoltageProbe,
)
from procedures.core.bench import ProcedureError, Role
from procedures.core.curves import curve
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import WithheldError
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.estimation.winding.connections import ReadingConnection, phase_factor
from procedures.estimation.winding.step_look import look_at_step
from procedures.estimation.winding.step_repeats import StepReading, fit_repeats
from procedures.estimation.winding.step_response import apparent_inductance, time_constant_63
from procedures.techniques.acquisition import configure, fill_screen, record
from procedures.techniques.alignment import Alignment, aligning
from procedures.techniques.step_probes import StepSource, probes_against_supply
from procedures.techniques.step_read_off import DrivenStep, ReadOffStep, loop_inductance, read_off_steps
from procedures.verification.settings import SupplyWiringSettings

_POINTS = 10_000
_PRE_TRIGGER = 0.3
#: The record is long enough when it holds this many time constants, and not more than twice as many.
_TIME_CONSTANTS = 9.0
#: The voltage may begin to rise this share of the record before the trigger; before that lies the baseline.
_LEAD = 0.2
_ATTEMPTS = 12
#: The step's voltage is at least this many times what the supply's zero may be off, up to this share of the rated current, and
#: the ranges leave this many times as much room.
_ABOVE_ZERO, _MOST_SHARE, _ZERO_ROOM = 5.0, 0.5, 1.5
#: The supply's current limit, in currents of the step.
_LIMIT = 2.0
#: The other axis carries current too: phases differ by some percent, and friction holds the rotor off d or q by some degrees. As k².
_OTHER_AXIS = 3e-3
#: A difference that the bridge's resistance makes is worth a notice beyond this.
_TELLING = 0.02
#: Length (s) of the first record where nothing is known.
_FIRST_GUESS = 0.05


class Polarity(Enum):
    """Direction of the d-axis step against the aligning current."""

    AGAINST = "against"
    ALONG = "along"


class DqInductanceTimeConstantSettings(SupplyWiringSettings):
    """Settings of §3.3.1."""

    align_share: float = Field(
        default=1.0, gt=0.0, le=1.0, description="aligning current, at most this share of the rated current"
    )
    settle: float = Field(default=1.0, gt=0.0, le=60.0, description="time for the rotor to come to rest, s")
    step_share: float = Field(
        default=0.10, gt=0.0, le=1.0, description="current at the end of the step, share of the rated current"
    )
    polarity: Polarity = Field(
        default=Polarity.AGAINST, description="d-axis step against (as in the note) or along the magnet"
    )
    record_time: float | None = Field(
        default=None,
        gt=0.0,
        le=100.0,
        description="first guess of the record's length, s; from L and R known earlier when not given, else 0.05",
    )
    repeats: int = Field(default=4, ge=1, le=100, description="steps on each axis")
    screen_reading: float = Field(
        default=0.03,
        gt=0.0,
        le=0.5,
        description="a time constant read off a screen is within this share of it, where the oscilloscope gives no waveform",
    )
    curve_shares: tuple[float, ...] = Field(
        default=(), description="further step currents, shares of the rated current, for inductance against current"
    )


@dataclass(frozen=True)
class RecordedStep:
    """Voltage and current of one step, and what drove it."""

    voltage: Waveform
    current: Waveform
    source: StepSource


class DqInductanceTimeConstant(Procedure[DqInductanceTimeConstantSettings]):
    """Ld and Lq from the time constant of a current step (§3.3.1)."""

    name: ClassVar[str] = "dq-inductance-time-constant"
    title: ClassVar[str] = "dq inductance, time constant"
    section: ClassVar[str] = "3.3.1"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("d_axis_inductance", "q_axis_inductance")

    def measure(self) -> None:
        """Align, lock and step: d first, then q."""
        with ExitStack() as energised:
            alignment = self.align_d(energised)
            self.lock_d(energised)
        voltage = self.set_step_d(alignment)
        self.conclude_d(voltage, self.record_d(voltage, alignment))
        self._curve("d", alignment)
        with ExitStack() as energised:
            self.align_q(energised)
            self.lock_q(energised)
        voltage = self.set_step_q(alignment)
        self.conclude_q(voltage, self.record_q(voltage, alignment))
        self._tell_whose_resistance()
        self._curve("q", alignment)

    @step("3.3.1-d/1", "Align the rotor to d: A to plus, B and C to minus", by_hand=True)
    def align_d(self, energised: ExitStack) -> Alignment:
        """Align with up to the rated current, as far as the supply gives it: friction holds a weakly aligned rotor off."""
        if self.bench.has(Role.DYNAMOMETER):
            self.bench.perform(UncoupleDynamometer())
        self.wiring.supply.connect(ALIGN_D)
        self.bench.perform(ReleaseRotor())
        current = self.aligning_current(self.settings.align_share)
        self.findings["aligning_current"] = current
        if current <= 0.15 * self.nameplate.rated_current:
            self.notice(
                "E11",
                text(
                    "the rotor was aligned with {current:.3g} A only, {share:.0%} of rated: friction may have held it off d and q; "
                    "align with more current",
                    current=current,
                    share=current / self.nameplate.rated_current,
                ),
            )
        return energised.enter_context(aligning(self.bench, current, self.settings.settle))

    @step("3.3.1-d/2", "Lock the shaft", by_hand=True)
    def lock_d(self, energised: ExitStack) -> None:
        """Lock under current, then switch it off."""
        self.bench.perform(LockRotor())
        self.wiring.supply.held(ALIGN_D)
        energised.close()

    @step(
        "3.3.1-d/3",
        "Prepare the step: B and C to plus, A to minus, level for about {step_share:.0%} of rated",
        by_hand=True,
    )
    def set_step_d(self, alignment: Alignment) -> float:
        """Return the step's voltage (V); polarity is recorded, and changeable."""
        against = self.settings.polarity is Polarity.AGAINST
        self.bench.perform(STEP_NEGATIVE if against else STEP_POSITIVE)
        self.findings["polarity"] = self.settings.polarity.value
        if against:
            self.notice(
                "E15",
                text(
                    "the d-axis step drives phase A against the aligning current, as in the note: it weakens the magnets' "
                    "flux, and with saturation gives a larger Ld than a step in the other direction"
                ),
            )
        return self._step_voltage(alignment)

    @step("3.3.1-d/4", "Switch on and record the current's step response")
    def record_d(self, voltage: float, alignment: Alignment) -> list[RecordedStep] | list[ReadOffStep]:
        """Return the steps, recorded or read off the screen."""
        return self._take("d", voltage, alignment, forward=self.settings.polarity is Polarity.ALONG)

    @step("3.3.1-d/5", "Ld is two thirds of time constant times resistance")
    def conclude_d(self, voltage: float, steps: list[RecordedStep] | list[ReadOffStep]) -> None:
        """Fit R and L to the recorded voltage and current; 2/3·τ·R stands beside."""
        self._conclude("d_axis_inductance", "d", voltage, steps)

    @step("3.3.1-q/1", "Align the rotor to q: B to plus, C to minus, A open", by_hand=True)
    def align_q(self, energised: ExitStack) -> None:
        """Turn the rotor to where phase A sees its q axis."""
        # Connected and verified while the shaft is still locked: nothing moves, and no EMF is in the reading.
        self.wiring.supply.connect(ALIGN_Q)
        self.bench.perform(ReleaseRotor())
        energised.enter_context(
            aligning(self.bench, self.aligning_current(self.settings.align_share), self.settings.settle)
        )

    @step("3.3.1-q/2", "Lock the shaft against the torque of the step", by_hand=True)
    def lock_q(self, energised: ExitStack) -> None:
        """Lock under current, then switch it off."""
        self.bench.perform(LockRotor())
        self.wiring.supply.held(ALIGN_Q)
        energised.close()

    @step(
        "3.3.1-q/3",
        "Prepare the step: A to plus, B and C to minus, level for about {step_share:.0%} of rated",
        by_hand=True,
    )
    def set_step_q(self, alignment: Alignment) -> float:
        """Return the step's voltage (V)."""
        self.bench.perform(STEP_POSITIVE)
        return self._step_voltage(alignment)

    @step("3.3.1-q/4", "Switch on and record the current's step response")
    def record_q(self, voltage: float, alignment: Alignment) -> list[RecordedStep] | list[ReadOffStep]:
        """Return the steps, recorded or read off the screen."""
        return self._take("q", voltage, alignment, forward=True)

    @step("3.3.1-q/5", "Lq is two thirds of time constant times resistance")
    def conclude_q(self, voltage: float, steps: list[RecordedStep] | list[ReadOffStep]) -> None:
        """Fit R and L to the recorded voltage and current; 2/3·τ·R stands beside."""
        self._conclude("q_axis_inductance", "q", voltage, steps)

    def _step_voltage(self, alignment: Alignment) -> float:
        """Return the step's voltage (V): for the current asked for, but not lost in what the supply's zero may be off."""
        current = self.current_level(self.settings.step_share, "step current")
        voltage = current * alignment.loop_resistance
        bound = min(self.nameplate.current_bound, self.bench.supply.maximum_current) / _LIMIT
        most = max(current, min(_MOST_SHARE * self.nameplate.rated_current, bound)) * alignment.loop_resistance
        raised = min(max(voltage, _ABOVE_ZERO * alignment.voltage_offset), most)
        if raised > voltage and "step_voltage_raised" not in self.findings:
            self.findings["step_voltage_raised"] = raised
            self.notice(
                "raised-step",
                text(
                    "the step is {raised:.3g} V, about {share:.0%} of the rated current, instead of {voltage:.3g} V: the supply's zero may "
                    "be off by {offset:.2g} V",
                    raised=raised,
                    share=raised / alignment.loop_resistance / self.nameplate.rated_current,
                    voltage=voltage,
                    offset=alignment.voltage_offset,
                ),
            )
        return raised

    def _curve(self, axis: str, alignment: Alignment) -> None:
        """Step to several currents in both directions on the held axis: flux over current, the apparent inductance."""
        if not self.settings.curve_shares:
            return
        if not self.bench.oscilloscope.gives_waveforms:
            raise ProcedureError(
                text(
                    "inductance against current needs waveforms, which this oscilloscope does not give; leave curve_shares out"
                )
            )
        factors = phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL)
        points = []
        for sign, connection in ((1.0, STEP_POSITIVE), (-1.0, STEP_NEGATIVE)):
            self.bench.perform(connection)
            for share in sorted(self.settings.curve_shares):
                current = self.current_level(share, "step current of the curve")
                steps = self._record(axis, current * alignment.loop_resistance, alignment, forward=sign > 0.0)
                apparent = [apparent_inductance(s.current.time, s.voltage.values, s.current.values) for s in steps]
                value, scatter, freedom = mean_of_readings([factors.y_equivalent * a.inductance for a in apparent])
                repeated = self.bench.uncertainties.statistical(
                    f"steps of L_{axis} at {share:g}", value, scatter, freedom
                )
                points.append(
                    {
                        "current": float(np.mean([a.current for a in apparent])),
                        "inductance": value,
                        "standard_uncertainty": float(self._with_probes(repeated, steps[-1]).u),
                        "repeatability": scatter,
                    }
                )
        self.findings.setdefault("curve", {})[axis] = sorted(points, key=lambda point: point["current"])

    def _take(
        self, axis: str, voltage: float, alignment: Alignment, *, forward: bool
    ) -> list[RecordedStep] | list[ReadOffStep]:
        """Record the steps, or have them read off where the oscilloscope gives no waveform."""
        scope, current = self.bench.oscilloscope, voltage / alignment.loop_resistance
        if scope.gives_waveforms:
            return self._record(axis, voltage, alignment, forward=forward)
        channels = [scope.channels(kind)[0] for kind in (ProbeKind.VOLTAGE, ProbeKind.CURRENT)]
        self.wiring.supply.probed(
            STEP_POSITIVE if forward else STEP_NEGATIVE,
            VoltageProbe(channels[0], Node.A, Node.B),
            CurrentProbe(channels[1], Terminal.A),
        )
        limit = min(_LIMIT * current, self.bench.supply.maximum_current, self.nameplate.current_bound)
        driven = DrivenStep(voltage, limit, current, forward, *channels)
        guess = self.settings.record_time or self._expected(axis)
        return read_off_steps(self.bench, driven, guess, self.settings.repeats)

    def _record(self, axis: str, voltage: float, alignment: Alignment, *, forward: bool) -> list[RecordedStep]:
        """Step until the record's length fits the time constant, then repeat."""
        scope = self.bench.oscilloscope
        v_channel = scope.channels(ProbeKind.VOLTAGE)[0]
        i_channel = scope.channels(ProbeKind.CURRENT)[0]
        self.wiring.supply.probed(
            STEP_POSITIVE if forward else STEP_NEGATIVE,
            VoltageProbe(v_channel, Node.A, Node.B),
            CurrentProbe(i_channel, Terminal.A),
        )
        sign = 1.0 if forward else -1.0
        current = voltage / alignment.loop_resistance
        # The supply gives more or less than it is set to.
        room = 1.3 + _ZERO_ROOM * alignment.voltage_offset / voltage
        fills = {}
        for channel, top in ((v_channel, voltage), (i_channel, current)):
            low, high = sorted((-0.1 * sign * top, room * sign * top))
            fills[channel] = abs(top) / configure(scope, channel, low, high)
        # Triggered by the channel that the step fills better, for a small signal drowns in its noise.
        source, top = (i_channel, current) if fills[i_channel] > 2.0 * fills[v_channel] else (v_channel, voltage)
        trigger = Trigger(source, 0.3 * sign * top, Slope.RISING if forward else Slope.FALLING)
        # The limit is a safety net that must not act on the step.
        limit = min(_LIMIT * current, self.bench.supply.maximum_current, self.nameplate.current_bound)

        known = self.known_value("stator_resistance")
        winding = (
            None
            if known is None
            else known / phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL).y_equivalent
        )
        driven = StepSource(voltage, alignment.voltage_offset, alignment.loop_resistance, winding)

        def once(record_time: float) -> RecordedStep:
            # The current of the step before must have died away: the loop is as slow to fall as to rise.
            self.bench.clock.sleep(record_time)
            scope.configure_acquisition(record_time, _POINTS, _PRE_TRIGGER)
            waves = record(
                self.bench,
                (v_channel, i_channel),
                trigger,
                timeout=10.0 + 2.0 * record_time,
                event=lambda: self.bench.supply.energised(voltage, limit),
            )
            return RecordedStep(waves[v_channel], waves[i_channel], driven)

        record_time = self.settings.record_time or self._expected(axis)
        for _ in range(_ATTEMPTS):
            seen = once(record_time)
            wanted = _wanted(seen)
            if scope.read_by_hand and wanted <= float(np.ptp(seen.current.time)):
                # A person sets width and ranges, and saves no record twice.
                return [seen, *(once(record_time) for _ in range(self.settings.repeats - 1))]
            if 0.5 * record_time <= wanted <= record_time:
                # The steps to come are this one again: a scope's gain is stated of full scale, not of what is shown.
                for wave in (seen.voltage, seen.current):
                    fill_screen(scope, wave)
                break
            record_time = min(max(1.3 * wanted, 0.05 * record_time), 4.0 * record_time)
        return [once(record_time) for _ in range(self.settings.repeats)]

    def _expected(self, axis: str) -> float:
        """Return a first guess of the record's length (s) from what an earlier procedure found."""
        inductance, resistance = self.known_value(f"{axis}_axis_inductance"), self.known_value("stator_resistance")
        if inductance is None or resistance is None:
            return _FIRST_GUESS
        return 1.3 * _TIME_CONSTANTS * inductance / resistance

    def _conclude(self, name: str, axis: str, voltage: float, steps: list[RecordedStep] | list[ReadOffStep]) -> None:
        read_off = [each for each in steps if isinstance(each, ReadOffStep)]
        if read_off:
            self._conclude_read_off(name, axis, read_off)
            return
        self._conclude_recorded(name, axis, voltage, [each for each in steps if isinstance(each, RecordedStep)])

    def _conclude_read_off(self, name: str, axis: str, steps: list[ReadOffStep]) -> None:
        """Report τ·R of what was read off; nothing tells whether the current's course was that of one time constant."""
        last = steps[-1]
        tau, resistance = (
            float(np.mean([each.time_constant for each in steps])),
            last.voltage.value / last.current.value,
        )
        self.findings[axis] = {
            "total_resistance": resistance,
            "time_constant": tau,
            "read_off": [each.crossing for each in steps],
            "voltage_rise_time": last.rise,
        }
        self._compare_with_bridge_resistance(axis, tau, resistance)
        factors = phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL)
        loop = loop_inductance(self.bench, axis, steps, self.settings.screen_reading)
        self.report(
            name,
            factors.y_equivalent * loop,
            section="3.3.1",
            estimator="time constant read off the screen times the loop's resistance by the supply's meters",
            note_value=factors.y_equivalent * last.crossing * resistance,
            winding=float((factors.winding * loop).x) if self.is_delta else None,
        )

    def _conclude_recorded(self, name: str, axis: str, voltage: float, steps: list[RecordedStep]) -> None:
        try:
            repeats = fit_repeats([_recorded(s) for s in steps])
        except WithheldError as error:
            nothing = self.bench.uncertainties.limit(name, 0.0, 0.0)
            self.report(name, nothing, section="3.3.1", estimator="", misfit=error.misfit)
            return
        fits, misfit = repeats.fits, repeats.misfit
        inductance, resistance = (
            self.bench.uncertainties.statistical(f"step fits of {symbol}_{axis}", *repeats.mean(fitted)[:3])
            for symbol, fitted in (("L", "inductance"), ("R", "resistance"))
        )
        loop = self._with_probes(inductance, steps[0])
        # Either channel of a scope may be late by half a sampling interval.
        late = Accuracy(gain=fits[-1].timing, source="as taken")
        loop = self.bench.uncertainties.instrument("skew of the channels", loop, late)
        factors = phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL)
        last = steps[-1]
        probes = probes_against_supply(last.voltage, last.current, last.source, misfit, float(resistance.x))
        misfit = Misfit.together((misfit, probes.misfit))
        off = Accuracy(gain=probes.share, source="against the supply's readings")
        loop = self.bench.uncertainties.instrument(f"oscilloscope, channel {last.current.channel}", loop, off)
        # What a supply's limit ended is not fitted.
        fitted_part = slice(0, fits[-1].residuals.size)
        tau = time_constant_63(last.current.time, last.current.values)
        tail = slice(-len(last.current.values) // 10, None)
        total_resistance = abs(voltage / float(last.current.values[tail].mean()))
        self.findings[axis] = {
            "winding_resistance": float(resistance.x),
            "winding_inductance": float(inductance.x),
            "total_resistance": total_resistance,
            "time_constant": float(inductance.x) / float(resistance.x),
            "time_constant_63": tau,
            "residual_current": fits[-1].residual_rms,
            "fit": curve(
                time=last.current.time[fitted_part],
                fitted=last.current.values[fitted_part] - fits[-1].residuals,
                residual=fits[-1].residuals,
            ),
        }
        self._compare_with_bridge_resistance(axis, tau, total_resistance)
        self.report(
            name,
            factors.y_equivalent * loop,
            section="3.3.1",
            estimator="output-error fit of R, L and offsets to recorded voltage and current",
            note_value=factors.y_equivalent * tau * total_resistance,
            winding=float((factors.winding * loop).x) if self.is_delta else None,
            misfit=misfit.of("inductance", name),
        )

    def _with_probes(self, quantity: UncertainReal, recorded: RecordedStep) -> UncertainReal:
        """Put on the gains of the voltage and the current channel; their offsets are fitted."""
        for wave in (recorded.voltage, recorded.current):
            gain = Accuracy(gain=wave.accuracy.gain, source=wave.accuracy.source)
            quantity = self.bench.uncertainties.instrument(f"oscilloscope, channel {wave.channel}", quantity, gain)
        return quantity

    def _compare_with_bridge_resistance(self, axis: str, tau: float, total_resistance: float) -> None:
        known = self.known_value("stator_resistance")
        if known is None:
            return
        from_bridge, from_loop = tau * known, tau * total_resistance / 1.5
        self.findings[axis] |= {
            "with_bridge_resistance": from_bridge,
            "bridge_resistance_error": from_bridge / from_loop - 1.0,
        }

    def _tell_whose_resistance(self) -> None:
        """Say once for both axes what the bridge's resistance would have done."""
        # An axis whose record was withheld has no findings.
        errors = [self.findings.get(axis, {}).get("bridge_resistance_error", 0.0) for axis in ("d", "q")]
        if max(abs(error) for error in errors) > _TELLING:
            self.notice(
                "E10",
                text(
                    "Ld and Lq by the note's formula, with the bridge's resistance, would be {d:+.1%} and {q:+.1%} off: "
                    "the R of L = τ·R is that of the whole loop, with leads, contacts and source",
                    d=errors[0],
                    q=errors[1],
                ),
            )


def _recorded(taken: RecordedStep) -> StepReading:
    """Return a step as the estimator takes it."""
    v, i = taken.voltage, taken.current
    return StepReading(i.time, v.values, i.values, v.resolution, i.resolution, _ends(v), _ends(i), _OTHER_AXIS)


def _ends(wave: Waveform) -> tuple[float, float] | None:
    """Return the ends of a channel's range, where its samples reached them."""
    return (float(wave.values.min()), float(wave.values.max())) if wave.clipped else None


def _wanted(taken: RecordedStep) -> float:
    """Return how long (s) a record must be to hold a step like this one."""
    seen = look_at_step(taken.current.time, taken.voltage.values, taken.current.values)
    lead, ramp = max(-seen.begin, 0.0), seen.end - seen.begin
    return max(_TIME_CONSTANTS * seen.time_constant + ramp / (1.0 - _PRE_TRIGGER), lead / _LEAD)
