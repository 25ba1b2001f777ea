"""Voltages that clamps add to the readings of a bridge and a voltmeter."""

import math

import numpy as np

from sim_instruments.disturbances.bench import Contacts
from sim_instruments.disturbances.first_order import lagged_now
from sim_instruments.world.settings import FloatArray
from sim_instruments.world.timeline import Timeline


class Clamp:
    """An instrument's clamp on the motor: each time it is put on it is another contact."""

    def __init__(self, contacts: Contacts, seed: tuple[int, int]) -> None:
        self._contacts = contacts
        self._random = np.random.default_rng(seed)
        self.resistance = 0.0
        self.put_on()

    def put_on(self) -> None:
        """Make the contact anew; `resistance` (Ω) is that of the new one, cold."""
        self.resistance = self._contacts.resistance * math.exp(self._contacts.remaking * self._random.standard_normal())


def contact_voltage(
    contacts: Contacts,
    resistance: float,
    timeline: Timeline,
    terminal: int,
    aperture: float,
    until: float,
    attached: float,
) -> float:
    """Return the mean voltage (V) over the `aperture` s before `until` (s), the clamp, of `resistance` (Ω), being on a terminal for
    `attached` s.
    """
    voltage = contacts.thermal_emf * math.exp(-max(attached, 0.0) / contacts.thermal_time)
    if not resistance:
        return voltage

    def current(times: FloatArray) -> FloatArray:
        past = np.minimum(times, until)
        sampled = timeline.sample(lambda segment, at: segment.terminal_currents(at), past)
        result: FloatArray = sampled[terminal]
        return result

    warmth = lagged_now(lambda times: current(times) ** 2, until, contacts.heating_time) / contacts.doubling_current**2
    mean = float(np.mean(current(until - aperture * np.linspace(0.0, 1.0, 33)))) if aperture > 0.0 else 0.0
    flowing = mean if aperture > 0.0 else float(current(np.array([until]))[0])
    return voltage + flowing * resistance * (1.0 + warmth)
