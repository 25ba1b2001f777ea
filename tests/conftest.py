"""What all tests share."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from tests.command_line import Call

# A loaded machine must not fail a test: speed is measured in tests/benchmarks.
# The suite has minutes; MOTORBENCH_EXAMPLES=1000 searches longer.
settings.register_profile("motorbench", deadline=None, max_examples=int(os.environ.get("MOTORBENCH_EXAMPLES", "40")))
settings.load_profile("motorbench")

# Two workers with two BLAS threads each only get in each other's way on two cores.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")


STATE = pytest.StashKey[str]()


def pytest_configure(config: pytest.Config) -> None:
    """Give these tests a state folder of their own: nothing of a bench beside them is seen, or held up."""
    folder = tempfile.mkdtemp(prefix="motorbench-state-")
    Path(folder).chmod(0o1777)
    config.stash[STATE] = os.environ["MOTORBENCH_STATE"] = folder


def pytest_unconfigure(config: pytest.Config) -> None:
    """Take it away again."""
    shutil.rmtree(config.stash[STATE], ignore_errors=True)


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
