"""What clamps add to the voltage that a voltmeter's leads sense."""

import math

import numpy as np

from sim_instruments.disturbances.bench import Contacts
from sim_instruments.disturbances.first_order import lagged_now
from sim_instruments.world.settings import FloatArray
from sim_instruments.world.timeline import Timeline


def contact_voltage(
    contacts: Contacts, timeline: Timeline, terminal: int, aperture: float, until: float, attached: float
) -> float:
    """Return the mean voltage (V) over the `aperture` s before `until` (s), the clamp being on a terminal for `attached` s."""
    voltage = contacts.thermal_emf * math.exp(-max(attached, 0.0) / contacts.thermal_time)
    if not contacts.resistance:
        return voltage

    def current(times: FloatArray) -> FloatArray:
        past = np.minimum(times, until)
        sampled = timeline.sample(lambda segment, at: segment.terminal_currents(at), past)
        result: FloatArray = sampled[terminal]
        return result

    warmth = lagged_now(lambda times: current(times) ** 2, until, contacts.heating_time) / contacts.doubling_current**2
    mean = float(np.mean(current(until - aperture * np.linspace(0.0, 1.0, 33)))) if aperture > 0.0 else 0.0
    flowing = mean if aperture > 0.0 else float(current(np.array([until]))[0])
    return voltage + flowing * contacts.resistance * (1.0 + warmth)
