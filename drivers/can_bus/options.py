"""What a station file may say about a CiA 402 inverter."""

from dataclasses import dataclass

from drivers.interfaces import Accuracy


@dataclass(frozen=True)
class Cia402Options:
    """Settings of an inverter with the CiA 402 profile over CANopen.

    `maximum_current` (A, peak) and `maximum_frequency` (Hz) are the station's limits. `current_scale` is peak amperes
    per ampere of the drive's scale (√2 for a drive that counts rms). The ramp has ended within `frequency_tolerance`
    (Hz) of the target, a current has settled within `current_tolerance` (of rated). Times are in s.
    """

    maximum_current: float
    maximum_frequency: float
    current_scale: float = 1.0
    frequency_tolerance: float = 0.05
    current_tolerance: float = 0.01
    transition_timeout: float = 1.0
    settle_timeout: float = 30.0
    poll_interval: float = 0.01
    serial_number: str | None = None
    current_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None
