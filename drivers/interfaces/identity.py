"""Base of every instrument: an identity, readings with an accuracy, and an end."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces.class_check import check_class, require_all
from drivers.interfaces.declarations import disconnects, makes_safe, question
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.watchdog import Watchdog

#: Receives each exchange of a driver with its instrument: direction ("write", "read"), the text or a summary of the bytes.
Traffic = Callable[[str, str], None]


@dataclass(frozen=True)
class Identity:
    """Identity of the instrument at an address (the four fields of `*IDN?`; empty where the instrument has none)."""

    manufacturer: str
    model: str
    serial_number: str = ""
    firmware: str = ""


@dataclass(frozen=True)
class Accuracy:
    """Limits of error of a reading as the specification or the calibration states them (half-widths, rectangular).

    `gain` is relative to the reading; `offset` and `resolution` are in the reading's unit. Gain and offset
    are common to all readings of one instrument in one range; resolution and `noise` (standard deviation) are not.
    """

    gain: float = 0.0
    offset: float = 0.0
    resolution: float = 0.0
    noise: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class Reading:
    """One value in SI units as an instrument gave it, with its accuracy and the bench time it was taken at (s)."""

    value: float
    unit: str
    accuracy: Accuracy
    time: float


class Instrument(Protocol):
    """Any instrument on the bench: it has a name and can be closed.

    Each role's interface is a class of this, and each driver one of its role's. Raises DeclarationError, when such a class is
    made, for a public method that does not declare what it does.
    """

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        check_class(cls)
        if Protocol in cls.__bases__:
            require_all(cls)

    @property
    @question
    @abstractmethod
    def identity(self) -> Identity:
        """Identity of the instrument."""

    @property
    @question
    def watchdog(self) -> Watchdog | None:
        """The watchdog that is armed; None where there is none."""
        return None

    @property
    @question
    def found_state(self) -> tuple[FoundSetting, ...]:
        """Settings found on opening that would change a figure; empty if none are checked."""
        return ()

    @property
    @question
    def read_by_hand(self) -> bool:
        """True if a person sets and reads the instrument; the person is asked only for what a step needs."""
        return False

    @disconnects
    @abstractmethod
    def close(self) -> None:
        """Close the connection; safe to call twice. Call `make_safe` first, which switches outputs off."""

    @makes_safe()
    @abstractmethod
    def make_safe(self) -> None:
        """Bring the instrument to its harmless state (output off, torque zero); does nothing for one that only listens."""
