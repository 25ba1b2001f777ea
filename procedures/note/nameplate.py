"""Figures that only the data sheet can give (§2.7, §2.8)."""

from typing import ClassVar

from drivers.interfaces.text import Text, text
from procedures.core.actions import EnterReading
from procedures.core.bench import Role
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step


class NameplateSettings(Settings):
    """There is nothing to set."""


class NameplateData(Procedure[NameplateSettings]):
    """Maximum phase current and rated speed, from the data sheet, asked for where the motor file has none (§2.7, §2.8)."""

    name: ClassVar[str] = "nameplate"
    title: ClassVar[str] = "Data sheet"
    section: ClassVar[str] = "2.7"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str, ...]] = ("maximum_current", "rated_speed")

    def measure(self) -> None:
        """Take both figures from the data sheet, marked as not measured."""
        self.maximum_current()
        self.rated_speed()

    @step("2.7/1", "Take the largest phase current, peak, from the data sheet", by_hand=True)
    def maximum_current(self) -> None:
        """Carry the maximum phase current (A, peak) through; it is the controller's per-unit current base."""
        value = self.nameplate.maximum_current
        if value is None:
            value = self._ask(
                "maximum_current", text("the largest phase current (peak) on the data sheet"), "A", 1e-3, 1e4
            )
        self.enter("maximum_current", value, section="2.7")

    @step("2.8/1", "Take the rated speed from the data sheet", by_hand=True)
    def rated_speed(self) -> None:
        """Carry the rated speed through: the highest at which full torque is available."""
        value = self.nameplate.rated_speed_rpm
        if value is None:
            value = self._ask("rated_speed_rpm", text("the rated speed on the data sheet"), "rpm", 1.0, 5e5)
        self.enter("rated_speed", value, section="2.8")

    def _ask(self, key: str, quantity: Text, unit: str, low: float, high: float) -> float:
        return self.bench.reading(EnterReading(key, quantity, unit, low, high))
