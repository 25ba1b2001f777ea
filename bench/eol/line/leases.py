"""A run's way to shared instruments: it asks the line's coordinator, and waits."""

from collections.abc import Callable, Collection, Iterable

from bench.eol.line.arbiter import Answer
from bench.eol.line.messages import GaveBack, Want
from drivers.interfaces import Clock, InstrumentError
from procedures.core.bench import Role


class Leases:
    """Shared instruments of one socket whose clock began at `offset` (s) of the line's time.

    `ask` sends a message to the coordinator, `answered` waits for the answer to a ticket. On a virtual bench the
    waiting itself takes no wall time, and the bench's time is brought forward.
    """

    def __init__(
        self,
        roles: Iterable[Role],
        clock: Clock,
        offset: float,
        ask: Callable[[Want | GaveBack], None],
        answered: Callable[[int], Answer],
        *,
        virtual: bool,
    ) -> None:
        self.roles = frozenset(roles)
        self._clock = clock
        self._offset = offset
        self._ask = ask
        self._answered = answered
        self._virtual = virtual
        self._ticket = 0
        self._asked = False

    def acquire(self, roles: Collection[Role], purpose: str) -> float:
        """Have these when it returns; gives the time (s) that was waited. Raises InstrumentError naming who has one too long."""
        began = self._clock.now()
        self._ticket += 1
        self._asked = True
        self._ask(Want(self._ticket, self._offset + began, tuple(sorted(role.value for role in roles)), purpose))
        answer = self._answered(self._ticket)
        if self._virtual:
            self._clock.sleep(max(0.0, answer.at - self._offset - began))
        waited = self._clock.now() - began
        if not answer.granted:
            self._asked = False
            instrument, holder = next(iter(sorted(answer.held.items())))
            raise InstrumentError(
                instrument,
                f"was not to be had within {waited:.0f} s: socket {holder.name} has it for {holder.purpose}, "
                f"for {answer.at - holder.since:.0f} s",
                remedy="See whether that socket is stuck, or give line.timeout in the station file more time",
            )
        return waited

    def release(self) -> None:
        """Give back what there is to give back, or withdraw what was asked for."""
        if self._asked:
            self._asked = False
            self._ask(GaveBack(self._offset + self._clock.now()))
