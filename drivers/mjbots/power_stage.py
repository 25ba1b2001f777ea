"""The power stage of a moteus: started with currents, stopped and made sure of."""

import math
from collections.abc import Mapping

from drivers.interfaces import Clock, CommunicationError, MeasurementError, ReportedError, polls
from drivers.interfaces.text import Text, text
from drivers.mjbots.controller import MoteusController
from drivers.mjbots.multiplex import FLOAT, INT8, read, write
from drivers.mjbots.registers import CURRENT, FAULT, STARTING, STOPPED, Register, fault_words, limit_words, mode_words

_STATE = read(Register.MODE, 1, INT8) + read(Register.FAULT, 1, INT8)
_IN_STATE = (Register.MODE, Register.FAULT)
_CURRENTS, _IN_CURRENTS = read(Register.Q_CURRENT, 2, FLOAT), (Register.Q_CURRENT, Register.D_CURRENT)
_SAMPLE = read(Register.POSITION, 2, FLOAT) + read(Register.Q_CURRENT, 2, FLOAT)
_IN_SAMPLE = (Register.POSITION, Register.VELOCITY, Register.Q_CURRENT, Register.D_CURRENT)
_STOP = write(Register.MODE, (STOPPED,), INT8)
_POLL = 0.002


def _said(d_current: float, q_current: float) -> str:
    return f"mode {CURRENT}, d {d_current:g} A, q {q_current:g} A"


def _payload(d_current: float, q_current: float) -> bytes:
    # The mode comes first: it sets every command to zero that is not in the same frame.
    return write(Register.MODE, (CURRENT,), INT8) + write(Register.Q_CURRENT_COMMAND, (q_current, d_current), FLOAT)


class MoteusPowerStage:
    """The power stage of one controller. A change may take `timeout` (s); stopped, it carries no current above `none` (A)."""

    def __init__(self, controller: MoteusController, clock: Clock, timeout: float, none: float) -> None:
        self._controller = controller
        self._clock = clock
        self._timeout = timeout
        self._none = none

    def start(self, d_current: float, q_current: float) -> str:
        """Regulate the d- and q-axis currents (A, peak), from stopped on; return what was commanded, for messages.

        A fault that was found is told by ReportedError, and cleared by the next stop; so is a start that it does not take.
        """
        found = self._stopped()
        if round(found[Register.MODE]) == FAULT:
            raise self._fault(found, "stop")
        command = self.command(d_current, q_current)
        for last in polls(self._clock, self._timeout, _POLL):
            mode = round((state := self.state())[Register.MODE])
            if mode == CURRENT:
                break
            if last or mode not in (STOPPED, *STARTING):
                raise self.left(state, command)
        return command

    def command(self, d_current: float, q_current: float) -> str:
        """Command both currents (A, peak), whatever it does now; return what was commanded, for messages."""
        result = _said(d_current, q_current)
        self._controller.ask(_payload(d_current, q_current) + _STATE, result, _IN_STATE)
        return result

    def sampled_command(self, d_current: float, q_current: float) -> Mapping[int, float]:
        """Command both currents (A, peak) of a power stage that regulates; return position, speed and currents of before.

        One frame does both. Raises ReportedError where it does not regulate any more.
        """
        said = _said(d_current, q_current)
        state = self._controller.ask(_payload(d_current, q_current) + _STATE + _SAMPLE, said, (*_IN_STATE, *_IN_SAMPLE))
        self.check(state, said)
        return state

    def sample(self) -> Mapping[int, float]:
        """Return position, speed and currents as they are; errors as for `sampled_command`."""
        state = self._controller.ask(_STATE + _SAMPLE, "read position and currents", (*_IN_STATE, *_IN_SAMPLE))
        self.check(state)
        return state

    def change(self, d_current: float, q_current: float) -> str:
        """Command both currents (A, peak) of a power stage that regulates; one that has stopped meanwhile is not started again.

        Raises ReportedError where it does not regulate any more.
        """
        self.check(self.state())
        return self.command(d_current, q_current)

    def stop(self) -> None:
        """Stop and make sure of it by mode and currents, over a renewed connection where the present one fails.

        Raises ReportedError naming a fault that was found, a mode that is kept or a current that still flows, CommunicationError where
        it does not answer.
        """
        try:
            found = self._stopped()
        except CommunicationError:
            # A lost frame or a bus that went down must not leave the bridge on.
            self._controller.reopen()
            found = self._stopped()
        self._check_currents()
        if round(found[Register.MODE]) == FAULT:
            raise self._fault(found, "stop")

    def command_zero(self) -> None:
        """Command no current; one that is stopped stays so, and one that waits for a stop is stopped."""
        mode = round(self.state()[Register.MODE])
        if mode == CURRENT:
            self.command(0.0, 0.0)
        elif mode != STOPPED:
            self._stopped()

    @property
    def is_off(self) -> bool:
        """Return whether it is stopped or in fault; raises CommunicationError where it does not answer."""
        return round(self.state()[Register.MODE]) in (STOPPED, FAULT)

    def state(self) -> Mapping[int, float]:
        """Return mode and fault code by register."""
        return self._controller.ask(_STATE, "read mode and fault", _IN_STATE)

    def check(self, state: Mapping[int, float], command: str = "") -> None:
        """Raise ReportedError where the drive does not regulate currents (any more)."""
        if round(state[Register.MODE]) != CURRENT:
            raise self.left(state, command)

    def left(self, state: Mapping[int, float], command: str = "") -> ReportedError:
        """Return the error of a drive that does not regulate currents though it was to."""
        mode = round(state[Register.MODE])
        if mode == FAULT:
            return self._fault(state, command)
        return ReportedError(
            self._controller.name,
            text("it regulates no current, its mode is {mode} ({words})", mode=mode, words=mode_words(mode)),
            command=command,
            remedy=text("See whether another program commands it, then try again"),
        )

    def limited(self, state: Mapping[int, float]) -> MeasurementError | None:
        """Return the error of a drive whose output is limited; None where nothing limits it."""
        code = round(state[Register.FAULT])
        words = limit_words(code)
        if words is None:
            return None
        return MeasurementError(
            self._controller.name,
            text("its output is limited by {limit} (code {code}): this reading is not used", limit=words, code=code),
            remedy=text("Ask for less current or speed, or raise that limit in the drive"),
        )

    def _stopped(self) -> Mapping[int, float]:
        """Command a stop and wait until it is there; return what mode and fault were before, a fault where there was one."""
        seen = [self._controller.ask(_STOP + _STATE, "stop", _IN_STATE)]
        for last in polls(self._clock, self._timeout, _POLL):
            if (mode := round((state := self.state())[Register.MODE])) == STOPPED:
                break
            if last:
                raise ReportedError(
                    self._controller.name,
                    text("stays in mode {mode} ({words}) after a stop", mode=mode, words=mode_words(mode)),
                    command="stop",
                    remedy=text("Switch its supply off"),
                )
            seen += [state, self._controller.ask(_STOP + _STATE, "stop", _IN_STATE)]
        return next((one for one in seen if round(one[Register.MODE]) == FAULT), seen[0])

    def _check_currents(self) -> None:
        for last in polls(self._clock, self._timeout, _POLL):
            if (current := self._current()) <= self._none:
                break
            if last:
                raise ReportedError(
                    self._controller.name,
                    text("is stopped, but {current:.3g} A still flow", current=current),
                    command="stop",
                    remedy=text("Switch its supply off; a motor that is turned fast may feed it"),
                )

    def _current(self) -> float:
        reply = self._controller.ask(_CURRENTS, "read currents", _IN_CURRENTS)
        return math.hypot(reply[Register.D_CURRENT], reply[Register.Q_CURRENT])

    def _fault(self, state: Mapping[int, float], command: str) -> ReportedError:
        code = round(state[Register.FAULT])
        what: Text = text("the drive is in fault {code}: {words}", code=code, words=fault_words(code))
        return ReportedError(
            self._controller.name, what, command=command, remedy=text("Remove the cause, then try again")
        )
