"""What a drive that regulates currents has against it, each from negligible to gross: for procedures that count on it."""

import math
from collections.abc import Callable

from tests.studies.disturbances.dirt import Dirt

#: Procedures by which a drive's errors are seen, a row of the study each.
BY_DRIVE = (("flux-map",), ("flux-map-standstill",), ("torque-constant",))


def _dead_time(dirt: Dirt) -> None:
    dirt.inverter(dead_time=dirt.log(5e-8, 5e-6), knee_current=dirt.log(1e-3, 0.1) * dirt.plate.rated_current)


def _device_drop(dirt: Dirt) -> None:
    dirt.inverter(
        device_drop=dirt.log(3e-4, 0.05) * (dirt.plate.rated_voltage or 24.0),
        device_resistance=dirt.log(1e-3, 0.5) * dirt.motor.stator_resistance_y,
        knee_current=dirt.log(1e-3, 0.1) * dirt.plate.rated_current,
    )


def _current_gain(dirt: Dirt) -> None:
    dirt.inverter(current_gain=dirt.either(-1.0, 1.0) * dirt.log(3e-4, 0.1))


def _current_offset(dirt: Dirt) -> None:
    for phase in "ab":
        size = dirt.either(-1.0, 1.0) * dirt.log(1e-4, 0.03) * dirt.plate.rated_current
        dirt.inverter(**{f"current_offset_{phase}": size})


def _voltage_gain(dirt: Dirt) -> None:
    dirt.inverter(voltage_gain=dirt.either(-1.0, 1.0) * dirt.log(3e-4, 0.1))


def _angle(dirt: Dirt) -> None:
    dirt.inverter(angle_error=dirt.either(-1.0, 1.0) * dirt.log(math.radians(0.05), math.radians(10.0)))


def _delay(dirt: Dirt) -> None:
    dirt.inverter(voltage_delay=dirt.either(-1.0, 1.0) * dirt.log(1e-6, 1e-4))


def _noise(dirt: Dirt) -> None:
    dirt.inverter(
        current_noise=dirt.log(1e-4, 0.03) * dirt.plate.rated_current,
        voltage_noise=dirt.log(1e-4, 0.03) * (dirt.plate.rated_voltage or 24.0),
    )


SOILS: dict[str, Callable[[Dirt], None]] = {
    "dead-time": _dead_time,
    "device-drop": _device_drop,
    "drive-current-gain": _current_gain,
    "drive-current-offset": _current_offset,
    "drive-voltage-gain": _voltage_gain,
    "drive-angle": _angle,
    "drive-delay": _delay,
    "drive-noise": _noise,
}
