"""Pole pairs from the back-EMF's frequency and the rotor's speed (§3.1.2.2, method 2)."""

from contextlib import ExitStack
from typing import ClassVar

import numpy as np
from pydantic import Field

from drivers.interfaces import ProbeKind, Reading
from procedures.core.actions import ALL_OPEN, CoupleDynamometer, Node, ReleaseRotor, VoltageProbe
from procedures.core.bench import Role
from procedures.core.demand import SPEED, Demand, Demands, Measurand
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.period import slower_wave
from procedures.techniques.acquisition import ranged_record
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.techniques.shaft.pole_pair_count import count, frequency_reading
from procedures.verification.settings import TurnedWiringSettings

_POINTS = 20_000


class PolePairsBackEmfSettings(TurnedWiringSettings):
    """Settings of §3.1.2.2, method 2."""

    speed_share: float = Field(default=0.8, gt=0.0, le=1.0, description="speed, share of the rated speed")
    record_time: float = Field(default=0.1, gt=0.0, le=10.0, description="length of the record, s")


class PolePairsBackEmf(Procedure[PolePairsBackEmfSettings]):
    """Pole pairs from the driven motor's voltage and the tachometer (§3.1.2.2, method 2)."""

    name: ClassVar[str] = "pole-pairs-back-emf"
    title: ClassVar[str] = "Pole pairs by back-EMF"
    section: ClassVar[str] = "3.1.2.2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE, Role.TACHOMETER})
    gives: ClassVar[tuple[str, ...]] = ("pole_pairs",)
    needs: ClassVar[Demands] = {
        Role.OSCILLOSCOPE: Demand(screen=(Measurand.FREQUENCY,), probes={ProbeKind.VOLTAGE: 1}),
        Role.TACHOMETER: SPEED,
    }

    def measure(self) -> None:
        """Drive, read frequency and speed, divide."""
        #: A slower wave beside the one whose frequency is read: the part of the frequency, and its share.
        self._slower: tuple[int, float] | None = None
        with ExitStack() as driven:
            self.drive(driven)
            frequency, uncertainty = self.read_frequency()
            speed = self.read_speed()
        self.conclude(frequency, uncertainty, speed)

    @step("3.1.2.2-2/1", "An external motor turns it at constant speed", by_hand=True)
    def drive(self, driven: ExitStack) -> None:
        """Leave the shaft turning until the stack is closed; the terminals are open."""
        self.bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())
        channel = self.bench.oscilloscope.channels(ProbeKind.VOLTAGE)[0]
        self.wiring.shaft.connect_probes((VoltageProbe(channel, Node.A, Node.B),))
        speed = driving_speed_rad(self.bench, self.nameplate, self.settings.speed_share)
        driven.enter_context(self.bench.dynamometer.driving_speed(speed))

    @step("3.1.2.2-2/2", "Read the back-EMF's frequency on the oscilloscope")
    def read_frequency(self) -> tuple[float, float]:
        """Return frequency (Hz) and its standard uncertainty."""
        scope = self.bench.oscilloscope
        channel = scope.channels(ProbeKind.VOLTAGE)[0]
        if hand_read := frequency_reading(self.bench, channel):
            return hand_read.value, hand_read.accuracy.offset + hand_read.accuracy.gain * hand_read.value
        scope.configure_acquisition(self.settings.record_time, _POINTS, 0.0)
        start = 4.0 * (self.nameplate.rated_voltage or 50.0)
        wave = ranged_record(self.bench, {channel: start}, 10.0 + self.settings.record_time)[channel]
        fit = fit_back_emf(wave.time, np.atleast_2d(wave.values))
        self._slower = slower_wave(wave.time, fit.residuals[0], fit.frequency, fit.fundamental()[0])
        return fit.frequency, fit.frequency_uncertainty

    @step("3.1.2.2-2/3", "Read the rotor's speed on the tachometer")
    def read_speed(self) -> Reading:
        """Return the speed (rad/s)."""
        return self.bench.tachometer.measure_speed()

    @step("3.1.2.2-2/4", "Pole pairs are the nearest whole number to 60 f / n")
    def conclude(self, frequency: float, uncertainty: float, speed: Reading) -> None:
        """Report the number of pole pairs if frequency and speed allow one whole number only."""
        count(self, frequency, uncertainty, speed, section="3.1.2.2", slower=self._slower)
