"""Value of a count of the transducer's speed and power: sources differ, so the bench itself settles it.

P is torque times speed, and the drive knows its own frequency: what contradicts them is refused before a figure uses it.
"""

import math

from drivers.delta.dyn200 import HIGHEST_DECIMALS, RPM, ShaftReading
from drivers.interfaces import MeasurementError
from drivers.interfaces.text import Text, text

#: Watts a count of 04H that the sources name.
POWER_STEPS = (0.1, 1.0, 10.0)
#: Fewer counts than this (shown or to be expected) settle nothing.
_FEWEST_COUNTS = 10
#: So many readings, one after the other, settle a scale or contradict it: while a load changes, filters lag apart.
READINGS = 3
#: Steps are decades: within this factor, P and T·ω agree.
_FACTOR = 2.0
#: Sensor and drive agree within this ratio at a steady speed (slip counts), and within the wide one while it changes.
STEADY, CHANGING = 1.33, 5.0
#: Below this (rad/s) neither sensor nor drive is asked.
_SLOWEST = 10.0


class PowerScale:
    """Watts a count of 04H: `stated` by the station, or found from torque and speed; `name` stands for the instrument."""

    def __init__(self, name: str, stated: float | None) -> None:
        self._name = name
        self._stated = stated
        self._proved: float | None = None
        self._last: float | None = None
        self._votes = 0

    def watts(self, reading: ShaftReading) -> float:
        """Return the magnitude of the power (W); torque times speed until the scale of its register is settled.

        Raises MeasurementError where the register contradicts torque and speed.
        """
        mechanical, counts = abs(reading.torque) * reading.speed, abs(reading.power_counts)
        self._judge(reading, mechanical, counts)
        return mechanical if self._proved is None else counts * self._proved

    def _judge(self, reading: ShaftReading, mechanical: float, counts: int) -> None:
        wanted = self._proved or self._stated
        largest = counts if wanted is None else max(counts, mechanical / wanted)
        if largest < _FEWEST_COUNTS and mechanical < _FEWEST_COUNTS * POWER_STEPS[-1]:
            return
        step = next((step for step in POWER_STEPS if _agree(mechanical, counts * step)), None)
        if wanted is not None and _agree(mechanical, counts * wanted):
            step = wanted
        self._votes = self._votes + 1 if self._votes and step == self._last else 1
        self._last = step
        if self._votes < READINGS:
            return
        if step is None or (wanted is not None and step != wanted):
            raise self._contradiction(reading, mechanical, step)
        self._proved = step

    def _contradiction(self, reading: ShaftReading, mechanical: float, step: float | None) -> MeasurementError:
        remedy: Text = (
            text(
                "Compare torque and speed with the sensor's display; its decimals (08H, 20H) or torque filter may be wrong"
            )
            if step is None
            else text("Set power_step = {step:g} in the station file, if the sensor's display agrees", step=step)
        )
        return MeasurementError(
            self._name,
            text(
                "the power's register shows {counts} counts, while {torque:.4g} N·m at {speed:.4g} rpm make {power:.4g} W",
                counts=reading.power_counts,
                torque=reading.torque,
                speed=reading.speed / RPM,
                power=mechanical,
            ),
            command="04H",
            remedy=remedy,
        )


class SpeedScale:
    """Return whether the transducer's speed and the drive's frequency agree; `decimals` are those of the speed."""

    def __init__(self, name: str, decimals: int) -> None:
        self._name = name
        self._decimals = decimals
        self._against = 0
        self.settled = False

    def compare(self, shown: float, driven: float, within: float = STEADY, readings: int = 1) -> bool:
        """Compare the speed shown (rad/s) with that of the drive's output frequency (rad/s); signs do not count.

        Returns whether the reading may be used: another is to be taken where it contradicts and is not the last. Raises
        MeasurementError where their ratio is not `within`, so many `readings` one after the other.
        """
        shown, driven = abs(shown), abs(driven)
        ratio = max(shown, 1e-9) / max(driven, 1e-9)
        # While it changes, the slow beginning settles nothing. Slip and filters may make much of it, but no powers of ten.
        slow, changing = max(shown, driven) < _SLOWEST, readings > 1
        slowly = slow or (changing and min(shown, driven) < _SLOWEST)
        if slowly and ((slow and changing) or not self._decades(ratio)):
            return True
        if 1 / STEADY <= ratio <= STEADY:
            self.settled, self._against = True, 0
            return True
        self._against = 0 if 1 / within <= ratio <= within else self._against + 1
        if self._against >= readings:
            raise self._contradiction(shown, driven, ratio)
        return self._against == 0

    def _decades(self, ratio: float) -> int:
        """Return by how many decimals sensor over drive is off; 0 where no other number of decimals explains it."""
        decades = round(math.log10(ratio))
        near = abs(math.log10(ratio) - decades) < math.log10(STEADY)
        return decades if near and 0 <= self._decimals + decades <= HIGHEST_DECIMALS else 0

    def _contradiction(self, shown: float, driven: float, ratio: float) -> MeasurementError:
        decades = self._decades(ratio)
        return MeasurementError(
            self._name,
            text(
                "the transducer shows {shown:.4g} rpm with {decimals} decimals, while the drive's frequency (2103H) makes {driven:.4g} rpm",
                shown=shown / RPM,
                decimals=self._decimals,
                driven=driven / RPM,
            ),
            command="02H",
            remedy=text("Set speed_decimals = {decimals} in the station file", decimals=self._decimals + decades)
            if decades
            else text("Check pole_pairs of the dynamometer, its coupling, and speed_decimals"),
        )


def _agree(one: float, other: float) -> bool:
    return other > 0 and 1 / _FACTOR <= one / other <= _FACTOR
