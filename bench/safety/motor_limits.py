"""The motor's own limits, in front of every instrument that could exceed them."""

import math
from contextlib import AbstractContextManager
from typing import Any

from drivers.interfaces import Dynamometer, Instrument, Inverter, SetpointError, Supply
from procedures.bench import Role
from procedures.nameplate import Nameplate


def with_motor_limits(role: Role, instrument: Instrument, nameplate: Nameplate) -> Instrument:
    """Return the instrument with the motor's limits in front; one that feeds nothing is returned as it is."""
    guard = {Role.SUPPLY: _LimitedSupply, Role.INVERTER: _LimitedInverter, Role.DYNAMOMETER: _LimitedDynamometer}.get(
        role
    )
    return guard(role.value, instrument, nameplate) if guard else instrument


class _Limited:
    def __init__(self, name: str, instrument: Any, nameplate: Nameplate) -> None:
        self._name = name
        self._instrument = instrument
        self._current = nameplate.current_bound
        self._current_owner = (
            "the motor (nameplate.maximum_current)"
            if nameplate.maximum_current is not None
            else "the motor (nameplate.rated_current)"
        )
        bound = nameplate.speed_bound_rpm
        self._speed = math.inf if bound is None else bound * 2.0 * math.pi / 60.0
        self._speed_owner = (
            "the motor (nameplate.maximum_speed_rpm)"
            if nameplate.maximum_speed_rpm is not None
            else "the motor (nameplate.rated_speed_rpm)"
        )

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._instrument, attribute)

    def _check(self, what: str, value: float, unit: str, bound: float, owner: str, *, signed: bool) -> None:
        # What is not a number passes on to the driver, which refuses it with its own range.
        if abs(value) > bound:
            raise SetpointError(self._name, what, value, unit, -bound if signed else 0.0, bound, owner)


class _LimitedSupply(_Limited):
    _instrument: Supply

    @property
    def maximum_current(self) -> float:
        """Largest current limit (A): the lesser of the instrument's and the motor's."""
        return min(self._instrument.maximum_current, self._current)

    def configure(self, voltage: float, current_limit: float) -> None:
        """Set voltage (V) and current limit (A)."""
        self._check("current limit", current_limit, "A", self._current, self._current_owner, signed=False)
        self._instrument.configure(voltage, current_limit)

    def energised(self, voltage: float, current_limit: float) -> AbstractContextManager[None]:
        """Configure and switch on for the length of the block."""
        self._check("current limit", current_limit, "A", self._current, self._current_owner, signed=False)
        return self._instrument.energised(voltage, current_limit)


class _LimitedInverter(_Limited):
    _instrument: Inverter

    @property
    def maximum_current(self) -> float:
        """Largest phase current (A, peak): the lesser of the drive's and the motor's."""
        return min(self._instrument.maximum_current, self._current)

    def driving_frequency(self, frequency: float, current: float) -> AbstractContextManager[None]:
        """Turn the field at a frequency (Hz) with a phase current (A, peak)."""
        self._check("current", current, "A", self._current, self._current_owner, signed=True)
        return self._instrument.driving_frequency(frequency, current)

    def driving_current(self, current: float) -> AbstractContextManager[None]:
        """Regulate the q-axis current (A, peak)."""
        self._check("current", current, "A", self._current, self._current_owner, signed=True)
        return self._instrument.driving_current(current)

    def set_current(self, current: float) -> None:
        """Change the q-axis current (A, peak)."""
        self._check("current", current, "A", self._current, self._current_owner, signed=True)
        self._instrument.set_current(current)


class _LimitedDynamometer(_Limited):
    _instrument: Dynamometer

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s): the lesser of the machine's and the motor's."""
        return min(self._instrument.maximum_speed, self._speed)

    def driving_speed(self, speed: float) -> AbstractContextManager[None]:
        """Hold a speed (rad/s) for the length of the block."""
        self._check("speed", speed, "rad/s", self._speed, self._speed_owner, signed=True)
        return self._instrument.driving_speed(speed)

    def set_speed(self, speed: float) -> None:
        """Change the commanded speed (rad/s)."""
        self._check("speed", speed, "rad/s", self._speed, self._speed_owner, signed=True)
        self._instrument.set_speed(speed)
