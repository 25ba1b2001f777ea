"""The speed at which a drive's torque balances a load."""

import math

import numpy as np
from scipy.optimize import brentq

from sim_instruments.six_step.circuit import Conduction, Idle
from sim_instruments.six_step.drive import SixStepError
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState, steady_state

_SPEED_LIMIT = 100.0


def stall_torque(bridge: Bridge) -> float:
    """Torque of the currents on the magnets as the speed goes to 0, averaged over a state, in N·m."""
    circuit = bridge.circuit(Conduction(Idle.OPEN))
    currents = circuit.shapes @ (circuit.drive / circuit.rates)
    swing = 1j * bridge.orders * (math.pi / 3)
    emf = (circuit.observables.emf[3:6] * (np.exp(swing) - 1) / swing).real.sum(axis=1)
    return float(currents @ emf)


def balance_load(bridge: Bridge, load_torque: float) -> SteadyState:
    """Steady state in which the shaft gives `load_torque` in N·m (negative: it is driven).

    Of several balances it is the one that a start from rest reaches first. Raises SixStepError when the load is not
    finite, exceeds what the drive gives from standstill, or drives it harder than it can brake.
    """
    if not math.isfinite(load_torque):
        raise SixStepError(f"load is {load_torque:g} N·m: a finite torque is needed")
    strongest = stall_torque(bridge) - bridge.drive.coulomb_friction
    if strongest <= 0 <= load_torque:
        raise SixStepError(
            f"the drive cannot start: it gives {strongest + bridge.drive.coulomb_friction:.4g} N·m at standstill against "
            f"{bridge.drive.coulomb_friction:.4g} N·m of Coulomb friction; check source voltage, resistances, EMF constant "
            "and advance angle"
        )
    if load_torque >= strongest:
        raise SixStepError(
            f"load {load_torque:g} N·m is above the stall torque: less than {strongest:.4g} N·m at the shaft is allowed "
            f"({bridge.drive.coulomb_friction:.4g} N·m of friction taken off)"
        )
    scale = bridge.no_load_speed
    low, high = 0.0, scale / 8
    guess: SteadyState | None = None

    def surplus(speed: float) -> float:
        nonlocal guess
        if speed == 0.0:
            return strongest - load_torque
        guess = steady_state(bridge, speed, None if guess is None else guess.start_currents)
        return guess.load_torque - load_torque

    while surplus(high) > 0:
        low, high = high, max(high + scale / 8, 1.1 * high)
        if high > _SPEED_LIMIT * scale:
            raise SixStepError(
                f"load {load_torque:g} N·m drives the machine harder than it can brake: no balance found below "
                f"{_SPEED_LIMIT * scale * 30 / math.pi:.4g} rpm; give a load nearer to 0"
            )
    speed = float(brentq(surplus, low, high, xtol=1e-13 * scale, rtol=1e-14))
    return steady_state(bridge, speed)
