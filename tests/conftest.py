"""What all tests share."""

import gc
import os
import shutil
import sys
import tempfile
import zlib
from collections.abc import Generator, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

if TYPE_CHECKING:
    from tests.command_line import Call

# A loaded machine must not fail a test: speed is measured in tests/benchmarks.
# The suite tries the same examples each time, in minutes; MOTORBENCH_EXAMPLES=1000 searches on, anew each time.
settings.register_profile("motorbench", deadline=None, max_examples=40, derandomize=True, database=None)
settings.register_profile("search", deadline=None, max_examples=int(os.environ.get("MOTORBENCH_EXAMPLES", "40")))
settings.load_profile("search" if "MOTORBENCH_EXAMPLES" in os.environ else "motorbench")
if "MOTORBENCH_EXAMPLES" not in os.environ:
    # Examples would else depend on which modules the worker has loaded by then, whose constants are sought for seconds.
    providers._get_local_constants = lambda: providers._local_constants

# What is imported and collected stays to the end: a fifth of the time went into looking for what does not.
gc.disable()
# Workers with several BLAS threads each only get in each other's way.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
# Else each of the processes that tests start would compile anew all that it loads.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


STATE = pytest.StashKey[str]()


def pytest_configure(config: pytest.Config) -> None:
    """Give these tests a state folder of their own: nothing of a bench beside them is seen, or held up."""
    folder = tempfile.mkdtemp(prefix="motorbench-state-")
    Path(folder).chmod(0o1777)
    config.stash[STATE] = os.environ["MOTORBENCH_STATE"] = folder
    if worker := getattr(config, "workerinput", None):
        # In a new clone each worker would else compile the same file at the same time as all others.
        first = len(config.args) * int(worker["workerid"].removeprefix("gw")) // worker["workercount"]
        config.args[:] = config.args[first:] + config.args[:first]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Have the tests in one order that mixes the folders: those that wait for real seconds run beside those that compute."""
    if hasattr(config, "workerinput"):
        root = config.rootpath
        items.sort(key=lambda item: (zlib.crc32(bytes(item.path.parent.relative_to(root))), str(item.path)))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Take it away again."""
    shutil.rmtree(config.stash[STATE], ignore_errors=True)


def pytest_xdist_auto_num_workers() -> int:
    """Have two workers more than cores, for many tests wait for real seconds; no more, for played instruments must answer in time."""
    return min(len(os.sched_getaffinity(0)) + 2, 6)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leave what collecting has made out of every later garbage collection: it stays to the end.

    So does its garbage: to find that fifth of it takes each worker a tenth of all that collecting takes.
    """
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)
        gc.enable()


@pytest.fixture(scope="session")
def postgresql() -> Iterator[str]:
    """A PostgreSQL server's address: of one that answers, or of this worker's own."""
    from tests.bench.eol.postgresql import server

    with server() as address:
        yield address


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> "Call":
    """The command line, in a folder of its own."""
    from tests.command_line import called

    monkeypatch.chdir(tmp_path)
    return partial(called, capsys)
