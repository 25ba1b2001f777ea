"""Processes forked from one that has loaded what they need: processes like any other, but for the second that loading takes."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import chdir, suppress
from multiprocessing.forkserver import ensure_running
from multiprocessing.reduction import DupFd
from pathlib import Path
from typing import Any

from bench.cli.main import main

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(
    [
        "__main__",
        "tests.studies.energised.held_run",
        "tests.studies.worlds.measured_motor",
        "tests.studies.energised.loaded_late",
        "bench.cli.demo",
        "bench.cli.run",
        "bench.cli.serve",
        "bench.cli.sim.serve",
        "bench.eol.line.batch",
        "bench.eol.line.workers.worker",
        "bench.eol.store.records",
        "bench.panel.app",
        "sim_instruments.server.served_bench",
        "sqlalchemy.dialects.postgresql.psycopg",
        "sqlalchemy.dialects.sqlite.pysqlite",
    ]
)
_ROOT = Path(__file__).parents[2]
#: A command ends within this time (s), however busy the machine.
_PATIENCE = 120.0


def context() -> Any:
    """Return multiprocessing's context that forks them."""
    # Small matrices gain nothing from threads of their own, which keep all cores busy waiting for each other.
    os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    return _CONTEXT


def ready() -> None:
    """Have the process that forks loaded now: whoever else asks for one takes this, and not the other way round.

    It loads what is the repository's, whatever lies in the folder of the test that comes first.
    """
    context()
    with chdir(_ROOT):
        ensure_running()


def _work_with(
    environment: Mapping[str, str], folder: str, work: Callable[..., None], *arguments: Any, streams: Sequence[DupFd]
) -> None:
    # To what asks, this is a process like any other.
    multiprocessing.current_process().name = "MainProcess"
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    for number, stream in enumerate(streams):
        received = stream.detach()
        os.dup2(received, number)
        os.close(received)
    _keep_descriptors()
    sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
    work(*arguments)


def _keep_descriptors() -> None:
    """Pass none but the standard streams on to programs begun from here.

    Descriptors that came over a socket are inheritable. A run that outlives the panel's server would hold the pipes open
    that its test reads to their end.
    """
    with os.scandir("/proc/self/fd") as entries:
        for number in [int(entry.name) for entry in entries]:
            # The one that lists them is gone by then.
            with suppress(OSError):
                if number > 2:
                    os.set_inheritable(number, False)


def motorbench(*words: str) -> None:
    """Do what the command line does with these words."""
    sys.argv = ["motorbench", *words]
    main()


def command(*words: object, environment: Mapping[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """Return how `motorbench` with these words has ended and what it said."""
    process = Forked(motorbench, *map(str, words), environment=environment)
    try:
        output, errors = process.communicate(_PATIENCE)
        assert process.returncode is not None
        return subprocess.CompletedProcess(["motorbench", *map(str, words)], process.returncode, output, errors)
    finally:
        process.close()


class Forked:
    """A process with pipes to its standard streams, as subprocess.Popen has it.

    `work` gets the arguments, in this process's environment and working folder, or the given ones.
    """

    def __init__(
        self,
        work: Callable[..., None],
        *arguments: Any,
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
    ) -> None:
        read_in, write_in = os.pipe()
        read_out, write_out = os.pipe()
        read_err, write_err = os.pipe()
        given = Descriptors(read_in, write_out, write_err)
        ready()
        forking = context()
        # The process that forks may have begun in another test's environment.
        own = dict(os.environ if environment is None else environment)
        self._process = forking.Process(
            target=_work_with, args=(own, str(folder or Path.cwd()), work, *arguments), kwargs={"streams": given}
        )
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


class Descriptors(list[int]):
    """Descriptors that reach a forked process, each to be detached there."""

    def __init__(self, *descriptors: int) -> None:
        super().__init__(descriptors)

    def __reduce__(self) -> tuple[Any, ...]:
        return list, ([DupFd(descriptor) for descriptor in self],)
