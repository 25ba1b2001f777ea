"""The power state machine of CiA 402 (IEC 61800-7-201, finite state automaton), walked one checked step at a time."""

from collections.abc import Sequence
from contextlib import suppress
from enum import Enum
from typing import Protocol

from drivers.interfaces import Clock, CommunicationError, ReportedError, polls
from drivers.interfaces.text import Text, text, text_of
from drivers.transport.can.network_management import Emergency, NmtState
from drivers.transport.can.objects import NodeObjects

CONTROLWORD, STATUSWORD, ERROR_CODE = 0x6040, 0x6041, 0x603F

#: Controlword commands.
DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION, FAULT_RESET = 0x00, 0x06, 0x07, 0x0F, 0x80

#: Bits of the statusword beside the states.
VOLTAGE_ENABLED, REMOTE, INTERNAL_LIMIT = 1 << 4, 1 << 9, 1 << 11

#: Error codes of CiA 402, annex; a code not listed is named by its group.
ERROR_NAMES = {
    0x2310: "continuous over-current",
    0x2320: "short circuit or earth leakage",
    0x2350: "load level fault (I²t)",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x4210: "excess temperature of the device",
    0x4310: "excess temperature of the drive",
    0x7121: "motor blocked",
    0x7122: "motor or commutation",
    0x7300: "sensor",
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "life guard or heartbeat error",
    0x8140: "recovered from bus off",
    0x8400: "velocity control",
    0x8611: "following error",
}
ERROR_GROUPS = {
    0x1: "generic error",
    0x2: "current",
    0x3: "voltage",
    0x4: "temperature",
    0x5: "device hardware",
    0x6: "device software",
    0x7: "additional modules",
    0x8: "monitoring",
    0x9: "external error",
    0xF: "manufacturer-specific",
}


class PowerState(Enum):
    """States by mask and value of the statusword."""

    NOT_READY = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def words(self) -> str:
        """The state's name as the profile writes it."""
        return self.name.replace("_", " ").capitalize()


def decode_state(statusword: int) -> PowerState:
    """Return the state a statusword stands for; raises ValueError for a pattern of no state."""
    for state in PowerState:
        mask, value = state.value
        if statusword & mask == value:
            return state
    raise ValueError(text("statusword 0x{statusword:04X} is not a valid state", statusword=statusword))


def error_name(code: int) -> str:
    """Return an error code with its name."""
    return f"0x{code:04X} ({ERROR_NAMES.get(code) or ERROR_GROUPS.get(code >> 12, 'unknown')})"


class NodeWatcher(Protocol):
    """Listener to what the node sends unasked."""

    @property
    def nmt_state(self) -> NmtState | None:
        """The node's state by what it has said last, None where it has said nothing."""

    def emergencies(self) -> Sequence[Emergency]:
        """Return the emergency frames of errors that the node has not taken back."""

    def forget_emergencies(self) -> None:
        """Take no notice of the emergency frames up to now."""


class ObjectReader(Protocol):
    """A source of objects: the node, or the objects that it sent at one instant."""

    def read(self, index: int, subindex: int, size: int, *, signed: bool = False) -> int:
        """Return a number of `size` bytes."""


class UnreachedStateError(ReportedError):
    """The drive answers, but stays in another state or mode than was commanded."""


class PowerStateMachine:
    """The drive's state, and the ways up and down; `timeout` (s) is for one transition."""

    def __init__(
        self,
        objects: NodeObjects,
        clock: Clock,
        *,
        timeout: float,
        poll_interval: float,
        connection: NodeWatcher | None = None,
    ) -> None:
        self._objects = objects
        self._connection = connection
        self._clock = clock
        self._timeout = timeout
        self._poll_interval = poll_interval

    def state(self) -> PowerState:
        """Return the present state; raises CommunicationError for a statusword of no state."""
        return self._decoded(self.statusword())

    def statusword(self, source: ObjectReader | None = None) -> int:
        """Return the statusword, as `source` has it."""
        return (source or self._objects).read(STATUSWORD, 0, 2)

    def _decoded(self, statusword: int) -> PowerState:
        try:
            return decode_state(statusword)
        except ValueError as error:
            raise CommunicationError(self._objects.name, text_of(error), command="read 0x6041:00") from error

    def check_fault(self, source: ObjectReader | None = None) -> PowerState:
        """Return the present state, as `source` has it; raises ReportedError with the error code where the drive is in fault."""
        state = self._decoded(self.statusword(source))
        if state in (PowerState.FAULT, PowerState.FAULT_REACTION_ACTIVE):
            raise self._fault("")
        return state

    def check_operation(self, source: ObjectReader | None = None, *, at_last: bool = False) -> int:
        """Return the statusword of a drive in operation, as `source` has it.

        Raises ReportedError where it is in fault or has left operation; one on its way up is waited for, but not `at_last`.
        """
        statusword = self.statusword(source)
        state = self._decoded(statusword)
        if state in (PowerState.FAULT, PowerState.FAULT_REACTION_ACTIVE):
            raise self._fault("")
        rising = state in (PowerState.READY_TO_SWITCH_ON, PowerState.SWITCHED_ON)
        if state is not PowerState.OPERATION_ENABLED and (at_last or not rising):
            raise ReportedError(
                self._objects.name,
                text("the drive has left operation by itself: {state}", state=state.words),
                command="read 0x6041:00",
                remedy=text(
                    "Check its quick stop, limit switch and enable inputs, and whether something else commands it"
                ),
            )
        nmt = self._connection.nmt_state if self._connection is not None else None
        if nmt not in (None, NmtState.OPERATIONAL):
            raise ReportedError(
                self._objects.name,
                text("the node has gone to {state} (NMT) by itself", state=nmt.words),
                remedy=text("Check whether it was switched off and on, and whether something else commands it"),
            )
        return statusword

    def enable(self) -> None:
        """Go from Switch on disabled to Operation enabled, step by step; raises ReportedError where the drive does not follow."""
        for command, wanted in (
            (SHUTDOWN, PowerState.READY_TO_SWITCH_ON),
            (SWITCH_ON, PowerState.SWITCHED_ON),
            (ENABLE_OPERATION, PowerState.OPERATION_ENABLED),
        ):
            self._command(command, wanted)

    def disable(self) -> None:
        """Go to Switch on disabled, from a fault too, and make sure of it.

        Raises ReportedError naming the fault where there was one, also when it could be reset.
        """
        fault: ReportedError | None = None
        # One request that the drive aborts must not keep it from the last command, which is confirmed.
        with suppress(ReportedError):
            # Before anything is read: harmless in every state, and off even if the replies are lost.
            self._objects.write(CONTROLWORD, 0, DISABLE_VOLTAGE, 2)
        with suppress(ReportedError):
            if self.state() in (PowerState.FAULT, PowerState.FAULT_REACTION_ACTIVE):
                fault = self._fault("")
                self._objects.write(CONTROLWORD, 0, FAULT_RESET, 2)
                if self._connection is not None:
                    self._connection.forget_emergencies()
        try:
            self._command(DISABLE_VOLTAGE, PowerState.SWITCH_ON_DISABLED)
        except ReportedError as error:
            raise fault or error from error
        if fault is not None:
            raise fault

    def _command(self, word: int, wanted: PowerState) -> None:
        command = f"0x6040 = {word:X}"
        self._objects.write(CONTROLWORD, 0, word, 2)
        for last in polls(self._clock, self._timeout, self._poll_interval):
            if (state := self._decoded(statusword := self.statusword())) is wanted:
                break
            if state is PowerState.FAULT and (last or word != DISABLE_VOLTAGE):
                raise self._fault(command)
            if last:
                raise UnreachedStateError(
                    self._objects.name,
                    text("stays in {actual}, {wanted} was commanded", actual=state.words, wanted=wanted.words),
                    command=command,
                    remedy=_why_not(statusword) if word != DISABLE_VOLTAGE else "",
                )

    def _fault(self, command: str) -> ReportedError:
        code = self._objects.read(ERROR_CODE, 0, 2)
        said = self._connection.emergencies() if self._connection is not None else ()
        frames = "; ".join(
            f"{error_name(one.code)}, 0x1001 = {one.register:02X} ({one.kinds}), {one.data.hex(' ')}" for one in said
        )
        what = text("the drive is in fault {fault}", fault=error_name(code))
        if said:
            what = text("{finding}; it sent the emergency {frames}", finding=what, frames=frames)
        return ReportedError(self._objects.name, what, command=command, remedy=text("Remove the cause, then try again"))


def _why_not(statusword: int) -> Text | str:
    """Return what a person sees to first where a drive does not follow, by the bits beside its state."""
    if not statusword & REMOTE:
        return text("Give control of the drive to the bus: something else has it (bit 9 of 0x6041 is 0)")
    if not statusword & VOLTAGE_ENABLED:
        return text("Switch on the feed of its power stage, and check its safety inputs (bit 4 of 0x6041 is 0)")
    return ""
