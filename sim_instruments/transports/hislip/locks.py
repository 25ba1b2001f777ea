"""Locks of an instrument that HiSLIP clients take: one exclusive, or any number that share a key (IVI-6.1, 6.5)."""

import asyncio

_REFUSED, _GRANTED, _GRANTED_SHARED, _WRONG = 0, 1, 2, 3


class Locks:
    """The holders of the locks, by the numbers of their sessions."""

    def __init__(self) -> None:
        self._exclusive: int | None = None
        self._shared: dict[int, bytes] = {}
        self._changed = asyncio.Event()

    @property
    def exclusive(self) -> bool:
        """True if a session holds the exclusive lock."""
        return self._exclusive is not None

    @property
    def holders(self) -> int:
        """Number of sessions that hold a lock."""
        return len(self._shared.keys() | ({self._exclusive} if self._exclusive is not None else set()))

    def allows(self, session: int) -> bool:
        """Return whether a session may use the instrument now."""
        if self._exclusive is not None:
            return self._exclusive == session
        return not self._shared or session in self._shared

    async def until_allowed(self, session: int) -> None:
        """Wait until a session may use the instrument."""
        while not self.allows(session):
            await self._changed.wait()

    async def request(self, session: int, key: bytes, timeout: float) -> int:
        """Return the control code of the answer to a request; an empty `key` asks for the exclusive lock, `timeout` in s."""
        if self._exclusive == session or (key and session in self._shared):
            return _WRONG
        try:
            async with asyncio.timeout(timeout):
                while not self._free(session, key):
                    await self._changed.wait()
        except TimeoutError:
            return _REFUSED
        if key:
            self._shared[session] = key
        else:
            self._exclusive = session
        self._tell()
        return _GRANTED

    def release(self, session: int) -> int:
        """Return the control code of the answer to a release: the exclusive lock goes first."""
        if self._exclusive == session:
            self._exclusive = None
            self._tell()
            return _GRANTED
        if session in self._shared:
            del self._shared[session]
            self._tell()
            return _GRANTED_SHARED
        return _WRONG

    def forget(self, session: int) -> None:
        """Release all that a session holds, for its end."""
        while self.release(session) != _WRONG:
            continue

    def _free(self, session: int, key: bytes) -> bool:
        if self._exclusive is not None:
            return False
        others = {held for holder, held in self._shared.items() if holder != session}
        return not others or others == {key} or (not key and session in self._shared and not others)

    def _tell(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()
