"""Base of every drive of the CiA 402 profile: objects, aborts (CiA 301), and the state machine (CiA 402-2)."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Literal, Protocol

if TYPE_CHECKING:
    from sim_instruments.world.world import World

Kind = Literal["i8", "u8", "i16", "u16", "i32", "u32", "text"]

TOO_HIGH, TOO_LOW, OUT_OF_RANGE = 0x06090031, 0x06090032, 0x06090030
DEVICE_STATE = 0x08000022

ERROR_REGISTER = 0x1001
CONTROL_WORD, STATUS_WORD, ERROR_CODE = 0x6040, 0x6041, 0x603F
MODE, MODE_DISPLAY, SUPPORTED_MODES = 0x6060, 0x6061, 0x6502
ACTUAL_VELOCITY, DC_VOLTAGE = 0x606C, 0x6079
QUICK_STOP_OPTION, SI_UNIT_VELOCITY = 0x605A, 0x60A9
NO_MODE = 0
#: 60A9h: turns (B4h) a minute (47h); its top byte is a power of ten. Thousandths as these drives come.
RPM = 0x00B44700
MILLI_RPM = 0xFD000000 | RPM
#: 605Ah: slow down on the quick stop ramp and stay in quick stop active.
_STAY_STOPPED = 6
_HALT, _FAULT_RESET, _REMOTE = 0x0100, 0x0080, 0x0200


class DriveState(IntEnum):
    """States of the power drive system, as the status word shows them, voltage enabled."""

    SWITCH_ON_DISABLED = 0x0050
    READY_TO_SWITCH_ON = 0x0031
    SWITCHED_ON = 0x0033
    OPERATION_ENABLED = 0x0037
    QUICK_STOP_ACTIVE = 0x0017
    FAULT = 0x0018


@dataclass(frozen=True)
class ObjectEntry:
    """One object: its index and subindex, name, type and access; `value` where it is constant, `mappable` into a PDO."""

    index: int
    name: str
    kind: Kind
    access: Literal["ro", "rw", "wo", "const"] = "ro"
    subindex: int = 0
    value: int | str | None = None
    mappable: bool = False


class SdoError(Exception):
    """A request that the drive aborts, with the abort code of CiA 301."""

    def __init__(self, code: int, message: str) -> None:
        self.code = code
        super().__init__(message)


class ObjectServer(Protocol):
    """A device whose object dictionary a node serves.

    It is asked for an object by its index, from subindex 2 on by `numbered(index, subindex)`.
    """

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """Return the object dictionary."""

    def read(self, index: int) -> int | None:
        """Return the value of an object that changes, None for others."""

    def write(self, index: int, value: int) -> None:
        """Write an object. Raises SdoError where the value or the state does not allow it."""

    def on_emergency(self, report: Callable[[int, int], None]) -> None:
        """Tell `report` the error code and error register of each fault, and zeroes of its reset."""


def numbered(index: int, subindex: int) -> int:
    """Return what a device is asked by for an object of several members."""
    return index if subindex < 2 else subindex << 16 | index


class PowerStage:
    """State, control word, mode of operation and error code of one drive."""

    def __init__(self, modes: tuple[int, ...]) -> None:
        self.state = DriveState.SWITCH_ON_DISABLED
        self.control = 0
        self.mode = NO_MODE
        self.error = 0
        self._modes = modes
        #: Is told the error code and the error register of each trip and, with zeroes, of its reset.
        self.report: Callable[[int, int], None] = lambda *_: None

    @property
    def active(self) -> bool:
        """Return whether operation is enabled in a mode."""
        return self.state is DriveState.OPERATION_ENABLED and self.mode != NO_MODE

    @property
    def stopped(self) -> bool:
        """Return whether the halt bit or a quick stop holds the motor."""
        return bool(self.control & _HALT) or self.state is DriveState.QUICK_STOP_ACTIVE

    @property
    def status(self) -> int:
        """The status word, without what a mode adds to it."""
        return int(self.state) | _REMOTE

    def readers(self, status: Callable[[], int]) -> dict[int, Callable[[], int]]:
        """Return what reads the objects that all drives have; `status` returns the status word with what a mode adds to it."""
        return {
            ERROR_REGISTER: lambda: error_register(self.error) if self.state is DriveState.FAULT else 0,
            ERROR_CODE: lambda: self.error,
            CONTROL_WORD: lambda: self.control,
            STATUS_WORD: status,
            MODE: lambda: self.mode,
            MODE_DISPLAY: lambda: self.mode,
        }

    def set_mode(self, value: int) -> None:
        """Choose a mode of operation, 0 for none. Raises SdoError where mode or state does not allow it."""
        if value not in (NO_MODE, *self._modes):
            allowed = " and ".join(str(mode) for mode in self._modes)
            raise SdoError(OUT_OF_RANGE, f"mode of operation {value} is not supported; allowed: {allowed}")
        if value != self.mode and self.state is DriveState.OPERATION_ENABLED:
            raise SdoError(DEVICE_STATE, "the mode of operation cannot change while operation is enabled")
        self.mode = value

    def trip(self, error: int) -> None:
        """Go to the fault state with an error code."""
        self.state, self.error = DriveState.FAULT, error
        self.report(error, error_register(error))

    def command(self, word: int) -> None:
        """Take a control word."""
        rising_reset = bool(word & _FAULT_RESET and not self.control & _FAULT_RESET)
        self.control = word
        if self.state is DriveState.FAULT:
            if rising_reset:
                self.error = 0
                self.state = DriveState.SWITCH_ON_DISABLED
                self.report(0, 0)
            return
        if not word & 0b0010:
            self.state = DriveState.SWITCH_ON_DISABLED
        elif not word & 0b0100:
            enabled = self.state is DriveState.OPERATION_ENABLED
            active = enabled or self.state is DriveState.QUICK_STOP_ACTIVE
            self.state = DriveState.QUICK_STOP_ACTIVE if active else DriveState.SWITCH_ON_DISABLED
        elif self.state is DriveState.QUICK_STOP_ACTIVE:
            if word & 0b1111 == 0b1111:
                self.state = DriveState.OPERATION_ENABLED
        elif not word & 0b0001:
            self.state = DriveState.READY_TO_SWITCH_ON
        elif self.state in (DriveState.READY_TO_SWITCH_ON, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED):
            # Controlword F in "ready to switch on" passes "switched on" by itself.
            self.state = DriveState.OPERATION_ENABLED if word & 0b1000 else DriveState.SWITCHED_ON


class PoweredDrive:
    """What every drive answers alike: its power stage, the objects that change, and a fault of what it feeds."""

    def __init__(self, world: "World", modes: tuple[int, ...]) -> None:
        self._world = world
        self._power = PowerStage(modes)
        self._powered = False
        self._readers: dict[int, Callable[[], int]] = {}

    def on_emergency(self, report: Callable[[int, int], None]) -> None:
        """Tell `report` the error code and error register of each fault, and zeroes of its reset."""
        self._power.report = report

    def read(self, index: int) -> int | None:
        """Return the value of an object that changes, None for others."""
        with self._world.lock:
            self._check_fault()
            reader = self._readers.get(index)
            return None if reader is None else reader()

    def write(self, index: int, value: int) -> None:
        """Write an object. Raises SdoError where the value or the state does not allow it."""
        low, high = self._limits().get(index, (value, value))
        if not low <= value <= high:
            code = TOO_HIGH if value > high else TOO_LOW
            raise SdoError(code, f"object {index:04X}h: {value} is outside {low} … {high}")
        with self._world.lock:
            self._check_fault()
            self._set(index, value)
            self._apply()

    def _limits(self) -> dict[int, tuple[int, int]]:
        """Return the lowest and highest value of objects."""
        return {CONTROL_WORD: (0, 0xFFFF)}

    def _set(self, index: int, value: int) -> None:
        """Take the value of an object."""
        if index == CONTROL_WORD:
            self._power.command(value)
        elif index == MODE:
            self._power.set_mode(value)

    def _apply(self) -> None:
        """Have what the drive feeds do what its objects say."""

    def _fault_code(self) -> int | None:
        """Return the error code of what the drive feeds, None where it has no fault."""
        return None

    def _check_fault(self) -> None:
        # A stage keeps its fault until it is switched on again; a fault that was reset is not one any more.
        if self._powered and (code := self._fault_code()) is not None:
            self._powered = False
            self._power.trip(code)


def error_register(code: int) -> int:
    """Return the error register of an error code: generic, and the group that the code's first digit stands for."""
    return 1 | {2: 1 << 1, 3: 1 << 2, 4: 1 << 3, 8: 1 << 5, 15: 1 << 7}.get(code >> 12, 0)


def counts_per_hertz(unit: int = MILLI_RPM, pole_pairs: int = 1) -> float:
    """Return the counts of a velocity in one Hz (electrical), with 60A9h as `unit`, of a drive set up with `pole_pairs`."""
    prefix = unit >> 24
    return 60.0 * 10.0 ** (256 - prefix if prefix & 0x80 else -prefix) / pole_pairs


def standard_entries(name: str, product: int, modes: int) -> tuple[ObjectEntry, ...]:
    """Return what all drives' dictionaries have in common: `modes` are the bits of 6502h."""
    return (
        ObjectEntry(0x1000, "Device type", "u32", "const", value=0x00020192),
        ObjectEntry(ERROR_REGISTER, "Error register", "u8"),
        ObjectEntry(0x1005, "COB-ID SYNC message", "u32", "const", value=0x80),
        ObjectEntry(0x1008, "Manufacturer device name", "text", "const", value=name),
        ObjectEntry(0x100C, "Guard time", "u16", "const", value=0),
        ObjectEntry(0x100D, "Life time factor", "u8", "const", value=0),
        ObjectEntry(0x1017, "Producer heartbeat time", "u16", "rw", value=0),
        ObjectEntry(0x1018, "Identity: highest subindex", "u8", "const", 0, 4),
        ObjectEntry(0x1018, "Identity: vendor", "u32", "const", 1, 0x000002FF),
        ObjectEntry(0x1018, "Identity: product code", "u32", "const", 2, product),
        ObjectEntry(0x1018, "Identity: revision", "u32", "const", 3, 0x00010000),
        ObjectEntry(0x1018, "Identity: serial number", "u32", "const", 4, 0x00000001),
        ObjectEntry(ERROR_CODE, "Error code", "u16"),
        ObjectEntry(CONTROL_WORD, "Controlword", "u16", "rw"),
        ObjectEntry(STATUS_WORD, "Statusword", "u16", mappable=True),
        ObjectEntry(QUICK_STOP_OPTION, "Quick stop option code", "i16", "const", value=_STAY_STOPPED),
        ObjectEntry(MODE, "Modes of operation", "i8", "rw"),
        ObjectEntry(MODE_DISPLAY, "Modes of operation display", "i8", mappable=True),
        ObjectEntry(ACTUAL_VELOCITY, "Velocity actual value", "i32", mappable=True),
        ObjectEntry(DC_VOLTAGE, "DC link circuit voltage", "u32", mappable=True),
        ObjectEntry(SUPPORTED_MODES, "Supported drive modes", "u32", value=modes),
    )
