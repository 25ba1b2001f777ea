"""Bring the rotor to a known angle with direct current, and know that the current really flows."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from drivers.interfaces import OutputMode
from procedures.bench import Bench, ProcedureError
from procedures.text import text

#: The supply must reach this share of the wanted current, else the path is open or too resistive.
_REACHED = 0.9


@dataclass(frozen=True)
class Alignment:
    """Voltage (V) and current (A) by the supply's meters while the rotor is held."""

    voltage: float
    current: float

    @property
    def loop_resistance(self) -> float:
        """Resistance (Ω) of the whole loop, leads and contacts with it."""
        return self.voltage / self.current


@contextmanager
def aligning(bench: Bench, current: float, settle: float) -> Iterator[Alignment]:
    """Hold the rotor with a direct current (A) for the length of the block; entered `settle` s after switching on.

    Raises ProcedureError where the current does not flow. The output is off after the block, however it ends.
    """
    supply = bench.supply
    with supply.energised(supply.maximum_voltage, current):
        bench.clock.sleep(settle)
        flowing = supply.measure_current().value
        if flowing < _REACHED * current:
            raise ProcedureError(
                text(
                    "the supply is set to {wanted:.3g} A and gives {flowing:.3g} A at {voltage:.3g} V ({mode}): the path is open "
                    "or its resistance too high. Check the connections just made",
                    wanted=current,
                    flowing=flowing,
                    voltage=supply.measure_voltage().value,
                    mode=supply.output_mode().value,
                )
            )
        if supply.output_mode() is not OutputMode.CONSTANT_CURRENT:
            raise ProcedureError(
                text("the supply does not regulate the current although it flows; check its settings and leads")
            )
        yield Alignment(supply.measure_voltage().value, flowing)
