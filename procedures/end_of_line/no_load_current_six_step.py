"""No-load current of a six-step drive: what the running motor takes from the DC source."""

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
    def run_up(self) -> list[Reading]:
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
            taken = []
            for _ in range(settings.readings):
                clock.sleep(settings.interval)
                taken.append(drive.measure_bus_current())
            self.findings |= {"frequency": frequency, "bus_voltage": drive.measure_bus_voltage().value}
        return taken

    @step("L8/3", "No-load current: the mean of the readings")
    def conclude(self, readings: list[Reading]) -> None:
        """Report the bus current (A)."""
        mean, uncertainty, freedom = mean_of_readings([reading.value for reading in readings])
        unc = self.bench.uncertainties
        current = unc.statistical("mean of the bus current", mean, uncertainty, freedom)
        self.report(
            "no_load_bus_current",
            unc.instrument("drive, bus current", current, readings[-1].accuracy),
            section=self.section,
            estimator="mean of the readings at the speed that the motor takes",
        )
