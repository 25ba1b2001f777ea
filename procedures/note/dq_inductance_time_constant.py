"""Ld and Lq from the current's response to a voltage step on the locked rotor (§3.3.1)."""

from contextlib import ExitStack
from enum import Enum
from typing import ClassVar

import numpy as np
from pydantic import Field

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import text
from procedures.core.actions import (
    ALIGN_D,
    ALIGN_Q,
    STEP_NEGATIVE,
    STEP_POSITIVE,
    ConnectProbes,
    CurrentProbe,
    LockRotor,
    Node,
    ReleaseRotor,
    Terminal,
    UncoupleDynamometer,
    VoltageProbe,
)
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import LOOP, Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.fitting.fit import WithheldError
from procedures.estimation.winding.connections import ReadingConnection, phase_factor
from procedures.techniques.winding.alignment import Alignment, aligning, at_rest
from procedures.techniques.winding.plots import fitted_step_plot
from procedures.techniques.winding.step_evaluation import SteppedLoop, apparent_point, loop_of_steps
from procedures.techniques.winding.step_probes import ProbesJudged, StepSource, probes_between_axes
from procedures.techniques.winding.step_read_off import ReadOffStep, loop_inductance, read_off_steps
from procedures.techniques.winding.step_recording import TIME_CONSTANTS, DrivenStep, RecordedStep, record_steps
from procedures.techniques.winding.supply_voltage import within_voltage
from procedures.verification.settings import SupplyWiringSettings

#: The step's voltage is at least this many times what the supply's zero may be off, up to this share of the rated current.
_ABOVE_ZERO, _MOST_SHARE = 5.0, 0.5
#: The supply's current limit, in currents of the step.
_LIMIT = 2.0
#: A step that a small supply bounds ends at this share of what it gives: its limit must not act on the step.
_OF_SUPPLY = 0.8
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
        description="relative half-width of the uncertainty of a time constant read off a screen, if the oscilloscope gives "
        "no waveform",
    )
    curve_shares: tuple[float, ...] = Field(
        default=(), description="further step currents, shares of the rated current, for inductance against current"
    )


class DqInductanceTimeConstant(Procedure[DqInductanceTimeConstantSettings]):
    """Ld and Lq from the time constant of a current step (§3.3.1)."""

    name: ClassVar[str] = "dq-inductance-time-constant"
    title: ClassVar[str] = "dq inductance, time constant"
    section: ClassVar[str] = "3.3.1"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("d_axis_inductance", "q_axis_inductance")
    needs: ClassVar[Demands] = {
        Role.SUPPLY: LOOP,
        Role.OSCILLOSCOPE: Demand(probes={ProbeKind.VOLTAGE: 1, ProbeKind.CURRENT: 1}),
    }

    def measure(self) -> None:
        """Align, lock and step: d first, then q."""
        with ExitStack() as energised:
            alignment = self.lock_d(energised, self.align_d(energised))
        voltage = self.set_step_d(alignment)
        of_d = self.conclude_d(voltage, self.record_d(voltage, alignment))
        self._curve("d", alignment)
        with ExitStack() as energised:
            self.align_q(energised)
            self.lock_q(energised)
        voltage = self.set_step_q(alignment)
        of_q = self.conclude_q(voltage, self.record_q(voltage, alignment))
        self._report_loops(of_d, of_q)
        self._tell_whose_resistance()
        self._curve("q", alignment)

    @step("3.3.1-d/1", "Align the rotor to d: A to plus, B and C to minus", by_hand=True)
    def align_d(self, energised: ExitStack) -> Alignment:
        """Align with up to the rated current, if the supply can give it: friction holds a weakly aligned rotor away from d."""
        self.wiring.supply.connect(ALIGN_D, UncoupleDynamometer())
        self.bench.perform(ReleaseRotor())
        current = within_voltage(self, self.aligning_current(self.settings.align_share))
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
    def lock_d(self, energised: ExitStack, swinging: Alignment) -> Alignment:
        """Lock under current, read the loop at rest, then switch off."""
        self.bench.perform(LockRotor())
        alignment = at_rest(self.bench, swinging)
        self.wiring.supply.held(ALIGN_D)
        energised.close()
        return alignment

    @step(
        "3.3.1-d/3",
        "Prepare the step: B and C to plus, A to minus, level for about {step_share:.0%} of rated",
        by_hand=True,
    )
    def set_step_d(self, alignment: Alignment) -> float:
        """Return the step's voltage (V); polarity is recorded, and changeable."""
        against = self.settings.polarity is Polarity.AGAINST
        self.bench.perform(STEP_NEGATIVE if against else STEP_POSITIVE, ConnectProbes(self._probes()))
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
    def conclude_d(self, voltage: float, steps: list[RecordedStep] | list[ReadOffStep]) -> SteppedLoop | None:
        """Fit R and L to the recorded voltage and current; also report 2/3·τ·R."""
        return self._conclude("d_axis_inductance", "d", voltage, steps)

    @step("3.3.1-q/1", "Align the rotor to q: B to plus, C to minus, A open", by_hand=True)
    def align_q(self, energised: ExitStack) -> None:
        """Turn the rotor until its q axis is on phase A."""
        # Connected and verified while the shaft is still locked: nothing moves, and no EMF is in the reading.
        self.wiring.supply.connect(ALIGN_Q)
        self.bench.perform(ReleaseRotor())
        energised.enter_context(
            aligning(
                self.bench, within_voltage(self, self.aligning_current(self.settings.align_share)), self.settings.settle
            )
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
        self.bench.perform(STEP_POSITIVE, ConnectProbes(self._probes()))
        return self._step_voltage(alignment)

    @step("3.3.1-q/4", "Switch on and record the current's step response")
    def record_q(self, voltage: float, alignment: Alignment) -> list[RecordedStep] | list[ReadOffStep]:
        """Return the steps, recorded or read off the screen."""
        return self._take("q", voltage, alignment, forward=True)

    @step("3.3.1-q/5", "Lq is two thirds of time constant times resistance")
    def conclude_q(self, voltage: float, steps: list[RecordedStep] | list[ReadOffStep]) -> SteppedLoop | None:
        """Fit R and L to the recorded voltage and current; 2/3·τ·R stands beside."""
        return self._conclude("q_axis_inductance", "q", voltage, steps)

    def _step_voltage(self, alignment: Alignment) -> float:
        """Return the step's voltage (V): for the current asked for, but not lost in what the supply's zero may be off."""
        current = within_voltage(self, self.current_level("step_share", text("step current"), _OF_SUPPLY))
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
                current = self.current_level("curve_shares", text("step current of the curve"), share=share)
                voltage = current * alignment.loop_resistance
                driven = self._driven(voltage, alignment, forward=sign > 0.0)
                guess = self.settings.record_time or self._expected(axis)
                steps = record_steps(self.bench, driven, self._source(voltage, alignment), guess, self.settings.repeats)
                points.append(apparent_point(self.bench, f"L_{axis} at {share:g}", steps, factors.y_equivalent))
        self.findings.setdefault("curve", {})[axis] = sorted(points, key=lambda point: point["current"])

    def _take(
        self, axis: str, voltage: float, alignment: Alignment, *, forward: bool
    ) -> list[RecordedStep] | list[ReadOffStep]:
        """Record the steps, or have them read off where the oscilloscope gives no waveform."""
        driven = self._driven(voltage, alignment, forward=forward)
        guess = self.settings.record_time or self._expected(axis)
        if self.bench.oscilloscope.gives_waveforms:
            source = self._source(voltage, alignment)
            return record_steps(self.bench, driven, source, guess, self.settings.repeats)
        return read_off_steps(self.bench, driven, guess, self.settings.repeats)

    def _driven(self, voltage: float, alignment: Alignment, *, forward: bool) -> DrivenStep:
        """Return the step to be taken, its probes verified."""
        probes = self._probes()
        self.wiring.supply.probed(STEP_POSITIVE if forward else STEP_NEGATIVE, *probes)
        current = voltage / alignment.loop_resistance
        # The limit is a safety net that must not act on the step.
        limit = min(_LIMIT * current, self.bench.supply.maximum_current, self.nameplate.current_bound)
        return DrivenStep(voltage, limit, current, forward, *(probe.channel for probe in probes))

    def _probes(self) -> tuple[VoltageProbe, CurrentProbe]:
        """Return the probes of a step."""
        voltage, current = (
            self.bench.oscilloscope.channels(kind)[0] for kind in (ProbeKind.VOLTAGE, ProbeKind.CURRENT)
        )
        return VoltageProbe(voltage, Node.A, Node.B), CurrentProbe(current, Terminal.A)

    def _source(self, voltage: float, alignment: Alignment) -> StepSource:
        known = self.known_value("stator_resistance")
        factors = phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL)
        winding = None if known is None else known / factors.y_equivalent
        return StepSource(voltage, alignment.voltage_offset, alignment.loop_resistance, winding)

    def _expected(self, axis: str) -> float:
        """Return a first guess of the record's length (s) from what an earlier procedure found."""
        inductance, resistance = self.known_value(f"{axis}_axis_inductance"), self.known_value("stator_resistance")
        if inductance is None or resistance is None:
            return _FIRST_GUESS
        return 1.3 * TIME_CONSTANTS * inductance / resistance

    def _conclude(
        self, name: str, axis: str, voltage: float, steps: list[RecordedStep] | list[ReadOffStep]
    ) -> SteppedLoop | None:
        """Return the loop that was recorded; what was read off is reported."""
        read_off = [each for each in steps if isinstance(each, ReadOffStep)]
        if read_off:
            self._conclude_read_off(name, axis, read_off)
            return None
        return self._conclude_recorded(name, axis, voltage, [each for each in steps if isinstance(each, RecordedStep)])

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

    def _conclude_recorded(self, name: str, axis: str, voltage: float, steps: list[RecordedStep]) -> SteppedLoop | None:
        try:
            loop = loop_of_steps(self.bench, axis, voltage, steps)
        except WithheldError as error:
            nothing = self.bench.uncertainties.limit(name, 0.0, 0.0)
            self.report(name, nothing, section="3.3.1", estimator="", misfit=error.misfit)
            return None
        found = self.findings[axis] = dict(loop.findings)
        self.bench.show(
            lambda: fitted_step_plot(found["fit"], len(steps), found["winding_resistance"], found["winding_inductance"])
        )
        self._compare_with_bridge_resistance(axis, loop.time_constant_63, loop.total_resistance)
        return loop

    def _report_loops(self, of_d: SteppedLoop | None, of_q: SteppedLoop | None) -> None:
        """Report what was recorded, once both axes can be held against each other."""
        probes = probes_between_axes(of_d.settled, of_q.settled) if of_d and of_q else ProbesJudged()
        factors = phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL)
        for name, recorded in (("d_axis_inductance", of_d), ("q_axis_inductance", of_q)):
            if recorded is None:
                continue
            loop = recorded.with_probes(self.bench, probes)
            self.report(
                name,
                factors.y_equivalent * loop.inductance,
                section="3.3.1",
                estimator="output-error fit of R, L and offsets to recorded voltage and current",
                note_value=factors.y_equivalent * loop.time_constant_63 * loop.total_resistance,
                winding=float((factors.winding * loop.inductance).x) if self.is_delta else None,
                misfit=loop.misfit.of("inductance", name),
            )

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
