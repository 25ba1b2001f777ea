"""No-load current of a six-step drive: what the running motor takes from the DC source."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from pydantic import Field

from drivers.interfaces import Reading
from drivers.interfaces.text import text
from procedures.core.actions import DRIVE, ReleaseRotor, UncoupleDynamometer
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import Demand, Demands, Measurand
from procedures.core.procedure import Procedure
from procedures.core.settings import Settings
from procedures.core.steps import step
from procedures.estimation.fitting.repeats import mean_of_readings

#: A speed is the same within so much of it, which no run-up that goes on stays within.
_SAME = 5e-6
#: Shares of the current that may still accelerate the rotor, and that are told.
_ACCELERATING, _TOLD = 0.01, 1e-3


class NoLoadCurrentSixStepSettings(Settings):
    """Settings of the six-step drive's no-load current."""

    readings: int = Field(default=8, ge=2, le=10_000, description="readings of the bus current")
    interval: float = Field(default=0.05, gt=0.0, le=10.0, description="time between readings, s")
    steady: float = Field(
        default=0.003,
        gt=0.0,
        le=0.2,
        description="relative change of speed between two readings below which the motor has run up",
    )
    look: float = Field(default=0.2, gt=0.0, le=10.0, description="time between two readings of the speed, s")
    longest: float = Field(default=30.0, gt=0.0, le=600.0, description="longest time to run up, s")


@dataclass(frozen=True)
class NoLoadReadings:
    """Readings of the bus current (A) within a `time` (s), and the frequencies (Hz, electrical) `before` and `after` them.

    `accelerating` (A) is how much of their mean may still accelerate the rotor.
    """

    readings: Sequence[Reading]
    before: float
    after: float
    time: float
    accelerating: float = 0.0

    @property
    def mean(self) -> float:
        """The mean current (A)."""
        return mean_of_readings([reading.value for reading in self.readings])[0]

    @property
    def steady(self) -> bool:
        """Whether the speed stayed the same while they were taken."""
        return abs(self.after - self.before) <= _SAME * self.after

    def accelerating_after(self, earlier: "NoLoadReadings") -> float:
        """Return how much of the current (A) accelerates the rotor: it goes with the acceleration as both fell since `earlier` ones."""
        then, now = ((each.after - each.before) / each.time for each in (earlier, self))
        fell = earlier.mean - self.mean
        return abs(fell) if then == now else abs(fell * now / (then - now))


class NoLoadCurrentSixStep(Procedure[NoLoadCurrentSixStepSettings]):
    """Mean current from the DC source while a six-step drive turns the uncoupled motor at full voltage."""

    name: ClassVar[str] = "no-load-current-six-step"
    title: ClassVar[str] = "No-load current, six-step drive"
    section: ClassVar[str] = "L8"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DRIVE})
    gives: ClassVar[tuple[str, ...]] = ("no_load_bus_current",)
    needs: ClassVar[Demands] = {Role.DRIVE: Demand((Measurand.VOLTAGE, Measurand.CURRENT, Measurand.FREQUENCY))}
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Connect, run up, read."""
        self.connect()
        self.conclude(self.run_up())

    @step("L8/1", "The motor alone on the six-step drive, its shaft free", by_hand=True)
    def connect(self) -> None:
        """Leave nothing on the shaft."""
        self.bench.perform(UncoupleDynamometer(), ReleaseRotor(), DRIVE)

    @step("L8/2", "Run at full voltage until the speed no longer rises, then read bus voltage and current")
    def run_up(self) -> NoLoadReadings:
        """Return the readings of the current (A). Raises ProcedureError where the speed does not settle."""
        drive, clock, settings = self.bench.drive, self.bench.clock, self.settings
        self.bench.thermometer.warmed()
        with drive.running():
            deadline, before = clock.now() + settings.longest, 0.0
            while True:
                clock.sleep(settings.look)
                frequency = drive.measure_frequency().value
                if before > 0.0 and abs(frequency / before - 1.0) <= settings.steady:
                    break
                if clock.now() > deadline:
                    raise ProcedureError(
                        text(
                            "after {longest:g} s the speed still changes: {before:.4g} Hz, then {now:.4g} Hz electrical; is the shaft "
                            "free, and are the Hall sensors in order?",
                            longest=settings.longest,
                            before=before,
                            now=frequency,
                        )
                    )
                before = frequency
            taken = self._taken(frequency)
            while not taken.steady:
                again = self._taken(taken.after)
                taken = replace(again, accelerating=again.accelerating_after(taken))
                if taken.accelerating <= _ACCELERATING * abs(taken.mean):
                    break
                if clock.now() > deadline:
                    raise ProcedureError(
                        text(
                            "after {longest:g} s about {share:.0%} of the current still accelerates the rotor: take off what is "
                            "coupled to the shaft, or raise longest=…",
                            longest=settings.longest,
                            share=taken.accelerating / max(abs(taken.mean), 1e-9),
                        )
                    )
            self.findings |= {"frequency": taken.before, "bus_voltage": drive.measure_bus_voltage().value}
        return taken

    def _taken(self, before: float) -> NoLoadReadings:
        """Return readings of the current, the first of which comes as the frequency (Hz) was read."""
        drive, clock, settings = self.bench.drive, self.bench.clock, self.settings
        begun, readings = clock.now(), []
        for _ in range(settings.readings):
            clock.sleep(settings.interval)
            readings.append(drive.measure_bus_current())
        # A person who types the readings has watched the display; nobody is asked for one more.
        after = before if drive.read_by_hand else drive.measure_frequency().value
        return NoLoadReadings(readings, before, after, clock.now() - begun)

    @step("L8/3", "No-load current: the mean of the readings")
    def conclude(self, taken: NoLoadReadings) -> None:
        """Report the bus current (A)."""
        mean, uncertainty, freedom = mean_of_readings([reading.value for reading in taken.readings])
        unc = self.bench.uncertainties
        current = unc.statistical("mean of the bus current", mean, uncertainty, freedom)
        if taken.accelerating > _TOLD * mean:
            current = current + unc.limit("current that still accelerates the rotor", 0.0, taken.accelerating)
        self.report(
            "no_load_bus_current",
            unc.instrument("drive, bus current", current, taken.readings[-1].accuracy),
            section=self.section,
            estimator="mean of the readings at the speed that the motor takes",
        )
