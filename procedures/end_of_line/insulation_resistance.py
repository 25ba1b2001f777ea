"""Insulation resistance between winding and frame."""

from collections.abc import Sequence
from typing import ClassVar

from pydantic import Field

from drivers.interfaces import BreakdownError, InsulationReading
from drivers.interfaces.text import Text, text
from procedures.core.actions import ALL_OPEN, Connect, LockRotor, Socket, Terminal
from procedures.core.bench import Bench, ProcedureError, Role
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.procedure_error import MotorFaultError
from procedures.core.result import Notice
from procedures.core.safety_test import SafetyTest
from procedures.core.settings import Settings
from procedures.core.steps import step

#: All three terminals to the tester's high side; its low side is on the frame.
ALL_HIGH = Connect(dict.fromkeys(Terminal, Socket.INSULATION_HIGH))
#: Test voltage (V DC) of windings rated below the first figure (V), IEEE 43, table 1; above, the table gives ranges.
_LOW_VOLTAGE, _LOW_VOLTAGE_TEST = 1000.0, 500.0


class InsulationResistanceSettings(Settings):
    """Settings of the insulation test."""

    test_voltage: float | None = Field(
        default=None,
        gt=0.0,
        le=10_000.0,
        description="test voltage, V; the nameplate's insulation_test_voltage when not given, and never above it",
    )
    duration: float = Field(default=1.0, gt=0.0, le=600.0, description="time from the voltage to the reading, s")


class InsulationResistance(Procedure[InsulationResistanceSettings]):
    """Resistance between the winding, its terminals joined, and the frame at a direct voltage (IEC 60034-27-4, IEEE 43).

    Both standards read after 60 s and hold for machines of 750 W or more. An earlier reading is the smaller one, for the
    absorption current has not died away yet: what passes after one second passes after a minute.
    """

    name: ClassVar[str] = "insulation-resistance"
    title: ClassVar[str] = "Insulation resistance"
    section: ClassVar[str] = "L7"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.INSULATION_TESTER})
    gives: ClassVar[tuple[str, ...]] = ("insulation_resistance",)
    safety_test: ClassVar[SafetyTest | None] = SafetyTest.INSULATION
    end_of_line: ClassVar[bool] = True

    @classmethod
    def check_capability(
        cls, bench: Bench, nameplate: Nameplate, settings: InsulationResistanceSettings
    ) -> Sequence[Notice]:
        """Report before the run that no test voltage is known, or that the tester does not reach it."""
        refused = _refused(bench, nameplate, settings)
        return (
            ()
            if refused is None
            else (Notice("cannot-support", Text("{name}: {why}", {"name": cls.name, "why": refused})),)
        )

    def measure(self) -> None:
        """Choose the voltage before anything is connected, connect, test, and part again."""
        voltage = self.choose_voltage()
        self.connect()
        reading = self.test(voltage)
        # After a test that broke off the winding may hold its charge: the shutdown sees to that, and no hand is sent there.
        self.part()
        self.conclude(reading)

    @step("L7/1", "The test voltage is that of the motor's data sheet")
    def choose_voltage(self) -> float:
        """Return the voltage (V); raises ProcedureError where none is known, or the tester does not reach it."""
        refused = _refused(self.bench, self.nameplate, self.settings)
        if refused is not None:
            raise ProcedureError(refused)
        return _wanted(self.nameplate, self.settings)

    @step(
        "L7/2",
        "Shaft at rest, probes and voltmeter off; all terminals together to the insulation tester, the frame to its low side",
        by_hand=True,
    )
    def connect(self) -> None:
        """Disconnect everything else from the terminals: the tester must be alone there."""
        self.bench.perform(LockRotor(), ALL_HIGH)

    @step("L7/3", "Apply the voltage, and read the resistance after {duration:g} s")
    def test(self, voltage: float) -> InsulationReading:
        """Return the reading; the tester has discharged the winding by then. Raises MotorFaultError where the insulation breaks down."""
        try:
            return self.bench.insulation_tester.measure(voltage, self.settings.duration)
        except BreakdownError as error:
            raise MotorFaultError(
                text("the insulation breaks down: {error}", error=error.text), "insulation"
            ) from error

    @step("L7/4", "The winding is discharged: take the tester off", by_hand=True)
    def part(self) -> None:
        """Leave the terminals open, because nothing else may be connected beside the tester."""
        self.bench.perform(ALL_OPEN)

    @step("L7/5", "The insulation resistance, or its lower bound")
    def conclude(self, reading: InsulationReading) -> None:
        """Report it; beyond the tester's range its largest figure stands for "at least"."""
        resistance = reading.resistance
        self.findings |= {
            "test_voltage": reading.voltage,
            "duration": self.settings.duration,
            "at_least": reading.beyond_range,
        }
        if reading.beyond_range:
            self.notice(
                "beyond-range",
                text(
                    "the insulation resistance is beyond the tester's range: it is {least:.3g} MΩ at least",
                    least=1e-6 * resistance.value,
                ),
            )
        quantity = self.bench.uncertainties.statistical("insulation resistance", resistance.value, 0.0)
        self.report(
            "insulation_resistance",
            self.bench.uncertainties.instrument("insulation tester", quantity, resistance.accuracy),
            section=self.section,
            estimator="largest reading of the tester: the resistance is this or more"
            if reading.beyond_range
            else "reading at the end of the test",
        )


def _wanted(nameplate: Nameplate, settings: InsulationResistanceSettings) -> float:
    return settings.test_voltage or nameplate.insulation_test_voltage or 0.0


def _refused(bench: Bench, nameplate: Nameplate, settings: InsulationResistanceSettings) -> Text | None:
    """Return why the insulation is not tested, or None."""
    allowed, voltage = nameplate.insulation_test_voltage, _wanted(nameplate, settings)
    if allowed is None:
        return text(
            "the motor file gives no insulation_test_voltage, and without it no insulation is tested; add it under "
            "[nameplate] from the data sheet{usual}",
            usual=_usual(nameplate.rated_voltage),
        )
    if voltage > allowed:
        return text(
            "test_voltage = {voltage:g} V is above the motor's {allowed:g} V (nameplate.insulation_test_voltage)",
            voltage=voltage,
            allowed=allowed,
        )
    largest = bench.insulation_tester.maximum_voltage
    if voltage > largest:
        return text(
            "the insulation tester gives up to {largest:g} V, {voltage:g} V are asked for; lower test_voltage",
            largest=largest,
            voltage=voltage,
        )
    return None


def _usual(rated: float | None) -> Text:
    if rated is None or rated >= _LOW_VOLTAGE:
        return text("")
    return text(
        "; for windings rated below {rated:g} V IEEE 43 has {voltage:g} V",
        rated=_LOW_VOLTAGE,
        voltage=_LOW_VOLTAGE_TEST,
    )
