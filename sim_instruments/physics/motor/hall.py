"""A motor's Hall sensors: three digital signals over the electrical angle, and what can be wrong with them."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Level = Literal["low", "high"]
#: Where sensor 1 of an ideal motor rises: 30° after the EMF of terminal A's phase has crossed zero upwards, turning forwards.
_IDEAL = 7.0 * math.pi / 6.0
_SPACING = 2.0 * math.pi / 3.0


@dataclass(frozen=True)
class SimulatedHallSensors:
    """Three sensors, each high for half an electrical turn, 120° apart; the leads are H1, H2, H3 against H0.

    Turning forwards, sensor 1 rises where block commutation switches terminal A to plus, `offset` (rad, electrical) later
    where it is positive; `placements` (rad) are each sensor's own error on top. `order` names the sensor on each lead,
    `inverted` the sensors with the magnets seen the other way round, `stuck` those that no longer switch.
    Low is 0 V, high is `voltage` (V). Raises ValueError for what no motor has.
    """

    offset: float = 0.0
    placements: tuple[float, float, float] = (0.0, 0.0, 0.0)
    order: tuple[int, int, int] = (1, 2, 3)
    inverted: tuple[int, ...] = ()
    stuck: tuple[tuple[int, Level], ...] = ()
    voltage: float = 5.0

    def __post_init__(self) -> None:
        if sorted(self.order) != [1, 2, 3]:
            raise ValueError(f"order of the Hall sensors is {list(self.order)}; each of 1, 2, 3 is on one lead")
        if not math.isfinite(self.offset) or not all(math.isfinite(angle) for angle in self.placements):
            raise ValueError("offset and placements of the Hall sensors must be finite angles")
        for sensor in (*self.inverted, *(sensor for sensor, _ in self.stuck)):
            if sensor not in (1, 2, 3):
                raise ValueError(f"Hall sensor {sensor} is unknown; there are 1, 2, 3")
        if not 0.0 < self.voltage < math.inf:
            raise ValueError(f"voltage of the Hall sensors is {self.voltage} V; it must be positive and finite")

    def levels(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the voltages (V, shape (3, n)) of H1, H2, H3 against H0.

        `angles` (n) are electrical, from the axis of terminal A's phase (of the Y-equivalent) to the d axis.
        """
        levels = np.empty((3, len(angles)))
        stuck = dict(self.stuck)
        for lead, sensor in enumerate(self.order):
            level = stuck.get(sensor)
            if level is not None:
                levels[lead] = self.voltage if level == "high" else 0.0
                continue
            start = _IDEAL + self.offset + self.placements[sensor - 1] + (sensor - 1) * _SPACING
            high = np.mod(angles - start, 2.0 * math.pi) < math.pi
            levels[lead] = np.where(high ^ (sensor in self.inverted), self.voltage, 0.0)
        return levels
