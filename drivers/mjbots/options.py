"""Options of motor controllers by mjbots in a station file."""

from dataclasses import dataclass

from drivers.catalogue import Driver
from drivers.interfaces import Accuracy, InverterAbility, Role
from drivers.interfaces.text import text
from drivers.mjbots.identity import RECOGNITION


@dataclass(frozen=True)
class MoteusOptions:
    """Settings of a moteus.

    `maximum_current` (A, peak) and `maximum_voltage` (V, of the DC bus) are the station's limits, to which the drive's own are lowered
    while it is in use. `pole_pairs` are those that it must be calibrated for. `can_prefix` is its `can.prefix`. Currents have settled
    within `current_tolerance` (A; 2 % of `maximum_current` where it is not given), at most `settle_timeout` (s) later; it is asked every
    `sample_interval` (s). An accuracy that is not given is assumed and named so.
    """

    maximum_current: float
    maximum_voltage: float | None = None
    pole_pairs: int | None = None
    can_prefix: int = 0
    serial_number: str | None = None
    current_tolerance: float | None = None
    settle_timeout: float = 2.0
    transition_timeout: float = 1.0
    sample_interval: float = 0.005
    current_accuracy: Accuracy | None = None
    voltage_accuracy: Accuracy | None = None
    frequency_accuracy: Accuracy | None = None

    def __post_init__(self) -> None:
        """Raise ValueError, beginning with the key, for what cannot be."""
        for key in ("maximum_current", "settle_timeout", "transition_timeout", "sample_interval"):
            _above_zero(key, getattr(self, key))
        for key in ("maximum_voltage", "current_tolerance"):
            if getattr(self, key) is not None:
                _above_zero(key, getattr(self, key))
        if self.pole_pairs is not None and self.pole_pairs < 1:
            raise ValueError(text("{key} = {number} must be 1 or more", key="pole_pairs", number=self.pole_pairs))
        if not 0 <= self.can_prefix < 1 << 13:
            raise ValueError(text("can_prefix = {number} must be 0 … 8191", number=self.can_prefix))


def _above_zero(key: str, value: float) -> None:
    if not 0.0 < value < float("inf"):
        raise ValueError(text("{key} = {number} must be above 0", key=key, number=value))


#: What it can do; its modes of a voltage at an angle have no current that is asked for.
ABILITIES = frozenset(
    {
        InverterAbility.Q_CURRENT,
        InverterAbility.DQ_CURRENT,
        InverterAbility.DQ_STROKES,
        InverterAbility.VOLTAGES,
        InverterAbility.ROTOR_ANGLE,
    }
)

MOTEUS = Driver(
    "mjbots-moteus",
    Role.INVERTER,
    MoteusOptions,
    "drivers.mjbots.inverter:MjbotsMoteus.open",
    simulated="mjbots-moteus",
    abilities=ABILITIES,
    recognised_by=(RECOGNITION,),
    sources=(
        "the maker's register map, protocol and firmware (mjbots/moteus, mjbots/mjlib)",
        "public programs of others that drive it",
    ),
    commands_in="drivers.mjbots",
)
