"""A hand that turns a shaft, or pulls an energised one over until it feels it drawn on to the next position."""

import math
from dataclasses import dataclass

import numpy as np

from sim_instruments.disturbances.bench import Hands
from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.windings import FloatArray, Windings
from sim_instruments.world.constants import Constants
from sim_instruments.world.segment import State
from sim_instruments.world.settings import WorldSettings

#: A hand that feels nothing turns this fast (rad/s).
BRISK = 0.5 * math.pi
#: Joined terminals brake a turning rotor: the hand goes on slowly enough that this share of the holding torque is not exceeded.
_DRAG_SHARE = 0.5
#: It lets go of a shaft whose motion is worth at most this share of the way down into a rest, so that it stays in the next one.
_SWING_SHARE = 0.005
#: A hand that turns the shaft has stopped after so long (s).
_LONGEST_TURNING = 300.0


@dataclass(frozen=True)
class Pull:
    """A pull of a hand: its way (rad, mechanical) and its speed (rad/s), both positive."""

    distance: float
    speed: float

    @property
    def duration(self) -> float:
        """The duration (s)."""
        return self.distance / self.speed


def uneven(
    hands: Hands, generator: np.random.Generator, speed: float, wobble: float, begin: float
) -> tuple[float, tuple[tuple[float, float], ...]]:
    """Return a hand's wobble and its pauses (from, to, s) when it begins to turn at a speed (rad/s)."""
    if not wobble:
        # So slow a hand only feels whether the shaft is free.
        return wobble, ()
    wobble = hands.unevenness or wobble
    if not hands.regrips or not speed:
        return wobble, ()
    stroke, pauses, time = 2.0 * math.pi / hands.regrips / abs(speed), [], begin
    while time < begin + _LONGEST_TURNING:
        time += stroke * float(generator.uniform(0.6, 1.4))
        pause = hands.regrip_time * float(generator.uniform(0.5, 1.5))
        pauses.append((time, time + pause))
        time += pause
    return wobble, tuple(pauses)


def pull_to_next(constants: Constants, settings: WorldSettings, state: State, direction: int) -> Pull | None:
    """Return the pull from here to where the next stable position clearly draws the shaft on.

    None where no direct current holds the shaft. Cogging is not felt against the current's torque.
    """
    if not settings.supply.on or settings.supply.tripped is not None:
        return None
    windings = constants.windings(settings, state.temperature, state.magnet_temperature, supplied=True)
    network = constants.network(windings, settings, supplied=True)
    if not network.drives_current:
        return None
    loops = np.linalg.solve(network.damping, network.drive)
    supplied = min(settings.supply.voltage, settings.supply.current_limit / float(network.drive @ loops))
    currents = network.basis @ loops * supplied
    period = 2.0 * math.pi / windings.pole_pairs
    way = np.linspace(0.0, 2.0 * period, 2881)
    angles = (state.angle + direction * way) * windings.pole_pairs
    # Seen along the way, a positive pull draws the shaft on and a negative one back.
    torque = direction * windings.torque(angles, np.repeat(currents[:, np.newaxis], len(way), axis=1))
    strongest = float(torque.max())
    if strongest <= 0.0:
        return None
    tops = np.nonzero((torque[:-1] <= 0.0) & (torque[1:] > 0.0))[0]
    # A shaft held a little short of its position still belongs to it: the first top a quarter period away counts.
    over = next((int(top) for top in tops if way[top] > 0.05 * period), None)
    if over is None:
        return None
    shaft = constants.shaft(settings)
    friction = shaft.static_friction + constants.motor.cogging_torque
    onward = torque[over:]
    depth = 2.0 * strongest / windings.pole_pairs
    swift = min(BRISK, math.sqrt(2.0 * _SWING_SHARE * depth / shaft.inertia))
    slow = _DRAG_SHARE * strongest / max(_drag(windings, network, angles), 1e-9)
    if slow >= swift:
        felt = np.nonzero(onward >= min(2.0 * friction + 0.1 * strongest, 0.98 * strongest))[0]
        return Pull(float(way[over + int(felt[0])]), swift)
    # A rotor that is braked hard does not snap but creeps: the hand goes with it until it is hardly drawn any more.
    top = int(np.argmax(onward >= 0.98 * strongest))
    spent = np.nonzero(onward[top:] <= friction + 0.05 * strongest)[0]
    return Pull(float(way[over + top + (int(spent[0]) if spent.size else 0)]), slow)


def _drag(windings: Windings, network: Network, angles: FloatArray) -> float:
    """Return the largest braking torque per speed (N·m·s/rad) of the currents that the supply does not regulate."""
    free = network.reach
    if not free.shape[1]:
        return 0.0
    emf = windings.pole_pairs * (free.T @ network.basis.T @ windings.emf_per_speed(angles))
    return float(np.max(np.sum(emf * np.linalg.solve(free.T @ network.damping @ free, emf), axis=0)))
