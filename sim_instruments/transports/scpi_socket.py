"""SCPI over a raw TCP socket: messages end with a newline, replies too."""

import asyncio
from collections.abc import Callable

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.framing import MessageSplitter
from sim_instruments.transports.client import Client
from sim_instruments.transports.conversation import Conversation

_CHUNK = 1 << 13
#: The longest message that an instrument takes.
INPUT_BUFFER = 1 << 16
#: A client that has shut its sending side has so long (s) for the rest of its replies.
_FAREWELL = 60.0


class ScpiSocket:
    """Serves the clients of one instrument's raw socket. There is no device clear and no serial poll by this way."""

    def __init__(self, converse: Callable[[], Conversation]) -> None:
        self._converse = converse

    async def serve(self, client: Client) -> None:
        """Answer one client until it hangs up."""
        conversation = self._converse()
        splitter = MessageSplitter(INPUT_BUFFER)
        departure = _Departure(client)
        try:
            while data := await client.read(_CHUNK, begun=splitter.begun):
                for message in splitter.feed(data):
                    if message is None:
                        conversation.session.report(ScpiError(-363))
                        await asyncio.sleep(0)
                        continue
                    reply = await conversation.exchange(message, departure.over)
                    for part in () if reply is None else reply.parts:
                        await client.send(part)
        finally:
            conversation.session.abandon()


class _Departure:
    """Tells whether a client is gone for good: one that has merely finished sending still wants its replies."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._since: float | None = None

    def over(self) -> bool:
        """Return whether nobody waits for replies any more."""
        if self._client.gone:
            return True
        if not self._client.finished:
            return False
        now = asyncio.get_running_loop().time()
        if self._since is None:
            self._since = now
        return now - self._since > _FAREWELL
