"""A hipot step: the winding holds a voltage against the frame, and little current leaks."""

from typing import ClassVar

from pydantic import Field

from drivers.interfaces import BreakdownError
from drivers.interfaces.text import text
from procedures.core.actions import ALL_OPEN, Connect, LockRotor, Socket, Terminal
from procedures.core.bench import Role
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure
from procedures.core.procedure_error import MotorFaultError
from procedures.core.safety_test import SafetyTest
from procedures.core.settings import Settings
from procedures.core.steps import step

LEAKAGE = ParameterDefinition(
    "leakage_current", "I_l", "A", text("Leakage current to the frame"), "DC, all terminals joined"
)


class HipotSettings(Settings):
    """Settings of the hipot step."""

    test_voltage: float = Field(default=500.0, gt=0.0, le=1000.0, description="test voltage, V DC")
    duration: float = Field(default=2.0, gt=0.0, le=60.0, description="time at the voltage, s")


class Hipot(Procedure[HipotSettings]):
    """Leakage current at the test voltage; a winding that does not hold it has failed."""

    name: ClassVar[str] = "hipot"
    title: ClassVar[str] = "Hipot"
    section: ClassVar[str] = "acme"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.INSULATION_TESTER})
    gives: ClassVar[tuple[str | ParameterDefinition, ...]] = (LEAKAGE,)
    safety_test: ClassVar[SafetyTest | None] = SafetyTest.VOLTAGE
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Join the terminals, apply the voltage, and part again."""
        self.join()
        self.hold()

    @step("acme/1", "All terminals to the tester, the frame to its low side", by_hand=True)
    def join(self) -> None:
        """Leave nothing else on the terminals."""
        self.bench.perform(LockRotor(), Connect(dict.fromkeys(Terminal, Socket.INSULATION_HIGH)))

    @step("acme/2", "Hold {test_voltage:g} V for {duration:g} s; leakage is the voltage over the resistance")
    def hold(self) -> None:
        """Report the leakage current; raises MotorFaultError where the voltage is not reached."""
        try:
            reading = self.bench.insulation_tester.measure(self.settings.test_voltage, self.settings.duration)
        except BreakdownError as error:
            raise MotorFaultError(text("hipot: {error}", error=error.text), "insulation") from error
        self.bench.perform(ALL_OPEN)
        resistance = self.bench.uncertainties.instrument(
            "insulation tester", reading.resistance.value, reading.resistance.accuracy
        )
        self.report(
            LEAKAGE.name, reading.voltage / resistance, section=self.section, estimator="voltage over resistance"
        )
