"""Processes forked from one that has loaded what they need: processes like any other, but for the second that loading takes."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.reduction import DupFd
from typing import Any

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(["__main__", "tests.studies.held_run", "tests.studies.measured_motor"])


def context() -> Any:
    """Return multiprocessing's context that forks them."""
    # Small matrices gain nothing from threads of their own, which keep all cores busy waiting for each other.
    os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    return _CONTEXT


def _work_with(state: str, work: Callable[..., None], *arguments: Any) -> None:
    if state:
        os.environ["MOTORBENCH_STATE"] = state
    work(*arguments)


class Forked:
    """A process with pipes to its standard streams, as subprocess.Popen has it.

    `work` gets the arguments and then the streams, which it puts in their places.
    """

    def __init__(self, work: Callable[..., None], *arguments: Any) -> None:
        read_in, write_in = os.pipe()
        read_out, write_out = os.pipe()
        read_err, write_err = os.pipe()
        given = _Streams(read_in, write_out, write_err)
        # The process that forks may have begun in another test's environment.
        state = os.environ.get("MOTORBENCH_STATE", "")
        self._process = context().Process(target=_work_with, args=(state, work, *arguments, given))
        self._process.start()
        for descriptor in (read_in, write_out, write_err):
            os.close(descriptor)
        self.stdin = os.fdopen(write_in, "w", encoding="utf-8")
        self.stdout = os.fdopen(read_out, encoding="utf-8")
        self.stderr = os.fdopen(read_err, encoding="utf-8")

    @property
    def pid(self) -> int:
        """Its number."""
        return int(self._process.pid)

    @property
    def returncode(self) -> int | None:
        """How it ended, the negative number of a signal, None while it goes on."""
        code: int | None = self._process.exitcode
        return code

    def send_signal(self, number: signal.Signals) -> None:
        """Send it a signal, if it is there."""
        if self.returncode is None:
            os.kill(self.pid, number)

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Return what else it says and has said as errors, once it has ended. Raises TimeoutError."""
        said = ["", ""]

        def read(place: int, stream: Any) -> None:
            said[place] = stream.read()

        readers = [
            threading.Thread(target=read, args=pair, daemon=True) for pair in enumerate((self.stdout, self.stderr))
        ]
        for reader in readers:
            reader.start()
        for reader in readers:
            reader.join(timeout)
            if reader.is_alive():
                raise TimeoutError(f"process {self.pid} has not ended within {timeout} s")
        self._process.join(timeout)
        return said[0], said[1]

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end, no longer than `timeout` (s)."""
        self._process.join(timeout)

    def close(self) -> None:
        """Leave nothing of it behind."""
        if self.returncode is None:
            self._process.kill()
        self._process.join()
        for stream in (self.stdin, self.stdout, self.stderr):
            with suppress(BrokenPipeError):
                stream.close()


class _Streams(list[int]):
    """Descriptors that reach a forked process."""

    def __init__(self, *descriptors: int) -> None:
        super().__init__(descriptors)

    def __reduce__(self) -> tuple[Any, ...]:
        return list, ([DupFd(descriptor) for descriptor in self],)
