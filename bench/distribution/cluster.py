"""Work done by a Dask cluster. Whoever reaches its scheduler may run anything on its workers: it belongs into a closed network."""

import hashlib
import pickle
from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack
from importlib.metadata import version
from itertools import islice
from logging import ERROR
from threading import Lock
from typing import TYPE_CHECKING, Any

from bench.distribution.work import DEATHS, Result, Task, Work, one_thread_each
from bench.i18n.errors import InputError
from drivers.interfaces.text import text

if TYPE_CHECKING:
    from distributed import Client

#: The cluster that is made here.
LOCAL = "local"
#: Parts under way at once, for each thread of the cluster.
_AHEAD = 3
#: How long (s) a scheduler may take to answer.
_PATIENCE = 10.0


def by_cluster(work: Work[Result], tasks: Sequence[Task], address: str, jobs: int) -> Generator[Result, None, None]:
    """Give the results as they come; the scheduler gives to others what a worker had in hand that died.

    Raises InputError where there is no such cluster, its workers have another version, or one part ends every worker.
    """
    one_thread_each()
    with ExitStack() as open_ones:
        client = _client(address, jobs, open_ones)
        from distributed import wait
        from distributed.scheduler import KilledWorker

        threads = _check_workers(client, address)
        # Sent with every part: what is scattered is lost with the worker that holds it.
        packed = pickle.dumps(work)
        waiting = iter(tasks)

        def submitted(count: int) -> set[Any]:
            return {client.submit(_do, packed, task, pure=False) for task in islice(waiting, count)}

        under_way = submitted(_AHEAD * threads)
        try:
            while under_way:
                done, under_way = wait(under_way, return_when="FIRST_COMPLETED")
                under_way |= submitted(len(done))
                yield from (future.result() for future in done)
        except KilledWorker:
            raise InputError(
                text(
                    "one part of the work has ended {deaths} workers of the cluster, possibly because memory ran out",
                    deaths=DEATHS,
                )
            ) from None
        finally:
            client.cancel(list(under_way))


def _client(address: str, jobs: int, open_ones: ExitStack) -> "Client":
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise InputError(
            text("--cluster needs dask.distributed: install the extra, pip install 'motorbench[cluster]'")
        ) from None
    open_ones.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": DEATHS}))
    if address == LOCAL:
        # Over TCP on loopback: dask's other way looks for a route to the internet.
        cluster = LocalCluster(
            n_workers=jobs,
            threads_per_worker=1,
            host="127.0.0.1",
            protocol="tcp://",
            # A port of its own: dask takes 8787 by itself, which another cluster of this machine may have.
            dashboard_address="127.0.0.1:0",
            silence_logs=ERROR,
        )
        address = open_ones.enter_context(cluster).scheduler_address
    try:
        client: Client = open_ones.enter_context(Client(address, timeout=_PATIENCE))
    except (OSError, ValueError) as error:
        raise InputError(
            text(
                "--cluster {address}: no scheduler answers there: {error}. Start one by dask scheduler, and workers by dask worker "
                "{address}; local makes a cluster here",
                address=address,
                error=str(error) or type(error).__name__,
            )
        ) from None
    return client


def _check_workers(client: "Client", address: str) -> int:
    """Return how many threads the cluster has. Raises InputError where it has no worker, or one with another version."""
    here = version("motorbench")
    try:
        versions = client.run(_version)
    except ModuleNotFoundError:
        versions = {address: ""}
    other = {worker: found for worker, found in versions.items() if found != here}
    if other:
        worker, found = next(iter(other.items()))
        raise InputError(
            text(
                "--cluster {address}: worker {worker} has motorbench {found}, here it is {here}: install the same version on all",
                address=address,
                worker=worker,
                found=found or "–",
                here=here,
            )
        )
    if not versions:
        raise InputError(
            text("--cluster {address}: there is no worker; start some by dask worker {address}", address=address)
        )
    return sum(client.nthreads().values())


def _version() -> str:
    return version("motorbench")


#: What this process does, by what it was told; one part at a time, for what measures is one bench.
_DO: dict[str, Callable[[Task], Any]] = {}
_LOCK = Lock()


def _do(packed: bytes, task: Task) -> Any:
    name = hashlib.sha256(packed).hexdigest()
    with _LOCK:
        if name not in _DO:
            _DO.clear()
            _DO[name] = pickle.loads(packed).begin()  # noqa: S301  a worker runs what its scheduler sends in any case
        return _DO[name](task)
