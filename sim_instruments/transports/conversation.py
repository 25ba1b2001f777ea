"""Messages of one client handled as bench time allows, without holding up anybody else."""

import asyncio
from collections.abc import Callable, Iterable, Iterator

from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.session import ClientSession, Outgoing

#: A wait is looked at again at least so often (s), whatever the clock is promised.
_LONGEST_WAIT = 1.0


class Conversation:
    """Has messages of a client handled one after the other."""

    def __init__(self, session: ClientSession, clock: PacedClock) -> None:
        self.session = session
        self._clock = clock

    def follow(self, look: Callable[[], None]) -> Callable[[], None]:
        """Run `look` whenever time has advanced; the function returned undoes it."""
        return self._clock.on_advance(lambda _: look())

    async def exchange(self, message: bytes, gone: Callable[[], bool]) -> Outgoing | None:
        """Return the reply to a message, None for one without; other tasks get their turn.

        Raises ConnectionAbortedError once `gone` says that nobody waits for the reply any more.
        """
        session = self.session
        try:
            session.write(message)
            while (reply := session.take()) is None and (wake := session.next_wake()) is not None:
                if gone():
                    raise ConnectionAbortedError  # noqa: TRY301  the same way out as for a client that is cut off
                await asyncio.sleep(min(max(0.0, wake - self._clock.now()) / self._clock.speedup, _LONGEST_WAIT))
        except ConnectionError:
            raise
        except Exception as error:  # noqa: BLE001  an instrument whose firmware stumbles says so and lives on
            session.clear()
            session.report(_stumble(error))
            reply = None
        await asyncio.sleep(0)
        return None if reply is None else Outgoing(self._made(reply.parts), reply.whole)

    def _made(self, parts: Iterable[bytes]) -> Iterator[bytes]:
        """Give the parts of a reply; one that cannot be made ends the connection, as nothing else can follow it."""
        try:
            yield from parts
        except Exception as error:
            self.session.report(_stumble(error))
            raise ConnectionAbortedError from error


def _stumble(error: Exception) -> ScpiError:
    return ScpiError(-310, f"System error;{type(error).__name__}: {error}")
