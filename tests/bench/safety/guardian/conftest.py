"""A virtual bench in a process of its own, and runs on it that are ended in every manner."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.studies.energised.held import Run, Served


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    made = Served(tmp_path_factory.mktemp("served"))
    yield made
    made.end()


@pytest.fixture
def hold(served: Served, tmp_path: Path) -> Iterator[Callable[..., Run]]:
    started = []

    def start(*then: str, station: Path | None = None) -> Run:
        started.append(Run(served, tmp_path, *then, station=station))
        return started[-1]

    yield start
    for one in started:
        one.drop()
