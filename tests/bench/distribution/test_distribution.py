"""Work gives the same on one process, on several and on a cluster, and loses nothing with a worker that dies."""

import socket
from contextlib import closing, suppress
from pathlib import Path

import pytest

from bench.distribution.workforce import Workforce
from bench.i18n.errors import InputError
from tests.bench.distribution.counting import Squares

TASKS = [(number,) for number in range(12)]
SQUARES = [number * number for number in range(12)]


@pytest.mark.parametrize("jobs", [1, 2])
def test_processes_do_it(jobs: int) -> None:
    assert sorted(Workforce(jobs).results(Squares(), TASKS)) == SQUARES


def test_what_a_process_that_died_had_in_hand_is_done_by_another(tmp_path: Path) -> None:
    work = Squares(5, str(tmp_path / "died"))
    assert sorted(Workforce(2).results(work, TASKS)) == SQUARES
    assert (tmp_path / "died").exists()


def test_a_part_that_ends_every_process_is_told() -> None:
    with pytest.raises(InputError, match="ended by themselves 3 times"):
        list(Workforce(1).results(Squares(5), TASKS))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_cluster_does_it_beside_another_and_loses_nothing_with_a_worker_that_is_killed(tmp_path: Path) -> None:
    work = Squares(5, str(tmp_path / "died"))
    with closing(socket.socket()) as other:
        # Where it is taken, somebody else's cluster has it.
        with suppress(OSError):
            other.bind(("127.0.0.1", 8787))
            other.listen()
        assert sorted(Workforce(2, "local").results(work, TASKS)) == SQUARES
    assert (tmp_path / "died").exists()


@pytest.mark.slow
def test_a_cluster_that_is_not_there_is_told() -> None:
    with pytest.raises(InputError, match="no scheduler answers there"):
        list(Workforce(1, "tcp://127.0.0.1:9").results(Squares(), TASKS))
