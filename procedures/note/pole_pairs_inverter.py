"""Pole pairs from the inverter's frequency and the rotor's speed (§3.1.2.2, method 1)."""

from contextlib import ExitStack
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from drivers.interfaces import InverterAbility, ProbeKind, Reading
from drivers.interfaces.text import text
from procedures.core.actions import INVERTER, CurrentProbe, ReleaseRotor, Terminal, UncoupleDynamometer
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import SPEED, Demand, Demands, Measurand
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.fitting.noise import MAINS, MAINS_STRAY
from procedures.techniques.acquisition import ranged_record
from procedures.techniques.shaft.pole_pair_count import count, frequency_reading, is_clear, ratio
from procedures.verification.settings import FedWiringSettings

_RECORD_PERIODS = 10
_POINTS = 20_000
#: The motor is turned once more where it can be turned this much faster.
_FASTER = 1.5


class PolePairsInverterSettings(FedWiringSettings):
    """Settings of §3.1.2.2, method 1."""

    frequency: float | None = Field(
        default=None, gt=0.0, le=2000.0, description="electrical frequency, Hz; from the rated speed when not given"
    )
    speed_share: float = Field(default=0.5, gt=0.0, le=1.0, description="speed aimed at, share of the rated speed")
    current_share: float = Field(default=0.3, gt=0.0, le=1.0, description="phase current, share of the rated current")
    settle: float = Field(default=1.0, ge=0.0, le=60.0, description="time at constant speed before reading, s")
    frequency_tolerance: float = Field(
        default=0.01, gt=0.0, lt=0.5, description="allowed difference to the inverter's frequency"
    )


@dataclass(frozen=True)
class PhaseCurrent:
    """Fitted frequency of the phase current (Hz) with its standard uncertainty."""

    frequency: float
    uncertainty: float


class PolePairsInverter(Procedure[PolePairsInverterSettings]):
    """Pole pairs from the phase current's frequency and the tachometer (§3.1.2.2, method 1)."""

    name: ClassVar[str] = "pole-pairs-inverter"
    title: ClassVar[str] = "Pole pairs by inverter"
    section: ClassVar[str] = "3.1.2.2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.INVERTER, Role.OSCILLOSCOPE, Role.TACHOMETER})
    gives: ClassVar[tuple[str, ...]] = ("pole_pairs",)
    needs: ClassVar[Demands] = {
        Role.INVERTER: Demand((Measurand.FREQUENCY,), abilities=frozenset({InverterAbility.FREQUENCY})),
        Role.OSCILLOSCOPE: Demand(screen=(Measurand.FREQUENCY,), probes={ProbeKind.CURRENT: 1}),
        Role.TACHOMETER: SPEED,
    }

    def measure(self) -> None:
        """Turn the motor by the inverter, read frequency and speed, divide."""
        frequency = self._frequency()
        current, speed = self._look(frequency, wire=True)
        found = ratio(current.frequency, current.uncertainty, speed)
        if self.settings.frequency is None and not is_clear(found):
            # The frequency was chosen for too few pole pairs, or for a share of a low speed: too slow to count by.
            faster = self._frequency(found.pole_pairs, share=1.0)
            if faster > _FASTER * frequency:
                current, speed = self._look(faster, wire=False)
        self.conclude(current, speed)

    def _look(self, frequency: float, *, wire: bool) -> tuple[PhaseCurrent, Reading]:
        with ExitStack() as turning:
            self.turn(turning, frequency, wire)
            current, speed = self.read_frequency(), self.read_speed()
            self._check_steady(current)
            return current, speed

    def _check_steady(self, current: PhaseCurrent) -> None:
        """Raise ProcedureError where the frequency has changed while the speed was read: they belong to different moments."""
        if self.bench.inverter.read_by_hand:
            return
        after = abs(self.bench.inverter.measure_frequency().value)
        if abs(after - current.frequency) > self.settings.frequency_tolerance * current.frequency:
            raise ProcedureError(
                text(
                    "the inverter put out {before:.4g} Hz before the speed was read and {after:.4g} Hz after it: it does not hold its "
                    "frequency; see whether it is in fault",
                    before=current.frequency,
                    after=after,
                )
            )

    @step("3.1.2.2-1/1", "The inverter turns the motor at a fixed frequency, as fast as possible", by_hand=True)
    def turn(self, turning: ExitStack, frequency: float, wire: bool) -> None:
        """Leave the motor turning at an electrical frequency (Hz) until the stack is closed; `wire` has it connected before."""
        if wire:
            self._wire()
        wanted = self.settings.current_share * self.nameplate.rated_current
        current = min(wanted, self.bench.inverter.maximum_current, self.nameplate.current_bound)
        self.bench.thermometer.warmed()
        turning.enter_context(self.bench.inverter.driving_frequency(frequency, current))
        self.bench.clock.sleep(self.settings.settle)

    @step("3.1.2.2-1/2", "Read the phase current's frequency on the oscilloscope; it must equal the inverter's")
    def read_frequency(self) -> PhaseCurrent:
        """Return the fitted frequency.

        Raises ProcedureError where it is not the inverter's: control was lost, or hum hides it.
        """
        scope = self.bench.oscilloscope
        commanded = self.bench.inverter.measure_frequency()
        channel = scope.channels(ProbeKind.CURRENT)[0]
        if hand_read := frequency_reading(self.bench, channel):
            measured = PhaseCurrent(
                hand_read.value, hand_read.accuracy.offset + hand_read.accuracy.gain * hand_read.value
            )
        else:
            record_time = _RECORD_PERIODS / abs(commanded.value)
            scope.configure_acquisition(record_time, _POINTS, 0.0)
            amplitude = self.settings.current_share * self.nameplate.rated_current
            wave = ranged_record(self.bench, {channel: 3.0 * amplitude}, 10.0 + record_time)[channel]
            fit = fit_back_emf(wave.time, np.atleast_2d(wave.values), harmonics=(1,))
            measured = PhaseCurrent(fit.frequency, fit.frequency_uncertainty)
        self.findings |= {"current_frequency": measured.frequency, "inverter_frequency": commanded.value}
        if abs(measured.frequency - abs(commanded.value)) > self.settings.frequency_tolerance * abs(commanded.value):
            if any(abs(measured.frequency / mains - 1.0) < MAINS_STRAY for mains in MAINS):
                raise ProcedureError(
                    text(
                        "the current probe shows {measured:.4g} Hz, as the mains have, the inverter puts out {commanded:.4g} Hz: more hum "
                        "than current of the motor; raise the current, or keep probe and leads away from the mains",
                        measured=measured.frequency,
                        commanded=commanded.value,
                    )
                )
            raise ProcedureError(
                text(
                    "the phase current has {measured:.4g} Hz, the inverter puts out {commanded:.4g} Hz: control was lost; "
                    "lower the frequency or raise the current",
                    measured=measured.frequency,
                    commanded=commanded.value,
                )
            )
        return measured

    @step("3.1.2.2-1/3", "Read the rotor's speed on the tachometer")
    def read_speed(self) -> Reading:
        """Return the speed (rad/s)."""
        return self.bench.tachometer.measure_speed()

    @step("3.1.2.2-1/4", "Pole pairs are the nearest whole number to 60 f / n")
    def conclude(self, current: PhaseCurrent, speed: Reading) -> None:
        """Report the number of pole pairs if frequency and speed allow one whole number only."""
        count(self, current.frequency, current.uncertainty, speed, section="3.1.2.2")

    def _wire(self) -> None:
        channel = self.bench.oscilloscope.channels(ProbeKind.CURRENT)[0]
        self.wiring.inverter.probed(INVERTER, CurrentProbe(channel, Terminal.A), UncoupleDynamometer(), ReleaseRotor())

    def _frequency(self, pairs: float | None = None, share: float | None = None) -> float:
        """Return the electrical frequency (Hz) to turn at: as set, or that share of the rated speed with so many pole pairs."""
        wanted = self.settings.frequency
        if wanted is None:
            if self.nameplate.rated_speed_rpm is None:
                raise ProcedureError(
                    text(
                        "the motor file gives no rated_speed_rpm, so no frequency can be chosen; set it with --set frequency=…"
                    )
                )
            pairs = pairs or self.known_value("pole_pairs") or self.nameplate.pole_pairs or 1
            wanted = (share or self.settings.speed_share) * self.nameplate.rated_speed_rpm / 60.0 * pairs
        return min(wanted, self.bench.inverter.maximum_frequency)
