"""An event loop on a thread of its own, for endpoints that serve many clients."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


class LoopThread:
    """Runs coroutines on one thread until it is closed."""

    def __init__(self, name: str) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name=name, daemon=True)
        self._thread.start()

    def run(self, work: Coroutine[Any, Any, T], timeout: float = 10.0) -> T:
        """Return what a coroutine returns. Raises TimeoutError where it takes longer than `timeout` (s)."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(timeout)

    async def call(self, function: Callable[..., T], *arguments: Any) -> T:
        """Return what a function returns that is called on this loop's thread; for coroutines of other loops."""

        async def called() -> T:
            return function(*arguments)

        return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(called(), self._loop))

    def soon(self, function: Callable[..., object], *arguments: Any) -> None:
        """Call a function on this loop's thread, after the calls that wait already; a closed loop calls nothing."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function, *arguments)

    def close(self) -> None:
        """End the loop and its tasks; again is allowed."""
        if self._loop.is_closed():
            return
        self.run(self._cancel_all())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.run_until_complete(self._loop.shutdown_asyncgens())
        self._loop.close()

    async def _cancel_all(self) -> None:
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)
        # Transports that are being closed need a turn of the loop to say so.
        await asyncio.sleep(0)
