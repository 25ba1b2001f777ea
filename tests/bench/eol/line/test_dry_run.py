"""A plan tried before a motor comes."""

import math
import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench.eol.line.preparation.dry_run import dry_run
from bench.eol.line.preparation.prepare import BatchRequest
from bench.eol.line.preparation.procedure_times import TimedClock
from bench.eol.line.workers.worker_process import ForkServer
from bench.i18n.errors import UsageError
from tests.bench.conftest import Clock

EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "eol"


def test_a_wait_is_needed_for_as_long_as_the_current_still_changes() -> None:
    bare = Clock()
    # A current that rises with 10 ms: within a ten-thousandth of its end after 9.2 time constants.
    clock = TimedClock(bare, lambda: (1.0 - math.exp(-bare.time / 0.01), 0.0), lambda: False)
    clock.sleep(1.0)
    assert bare.time == pytest.approx(1.0)
    assert clock.needless == pytest.approx(1.0 - 0.092, abs=0.03)


def test_a_turning_shaft_that_still_gains_speed_is_waited_for() -> None:
    bare = Clock()
    clock = TimedClock(bare, lambda: (0.0, 50.0 * bare.time), lambda: False)
    clock.sleep(2.0)
    assert clock.needless == pytest.approx(0.0, abs=1e-9)


def test_a_record_and_the_time_between_readings_are_needed() -> None:
    bare = Clock()
    recording = TimedClock(bare, lambda: (0.0, 0.0), lambda: True)
    recording.sleep(1.0)
    sampling = TimedClock(bare, lambda: (0.0, 0.0), lambda: False)
    sampling.sleep(0.004)
    assert (recording.needless, sampling.needless) == (0.0, 0.0)


@pytest.mark.slow
def test_the_example_plan_can_be_decided_and_wastes_less_than_a_tenth(fork_server: ForkServer) -> None:
    request = BatchRequest(EXAMPLE / "plan.toml", str(EXAMPLE / "line.toml"), Path(), motors=2, sockets=2)
    done = dry_run(request, fork_server)
    assert done.good, done.troubles or done.limits
    assert 0.0 <= done.overhead <= 0.1
    assert {each.procedure for each in done.procedures} >= {"stator-resistance-dc", "inertia"}
    assert all(each.floor <= each.time for each in done.procedures)
    assert done.waits > 0.0, "two sockets, one bridge"
    assert done.per_hour == pytest.approx(3600.0 * 2 / done.cycle)


def test_limits_that_cannot_be_decided_are_named(bench: Any) -> None:
    plan = bench.folder / "plan.toml"
    content = plan.read_text(encoding="utf-8").replace("percent = 60.0", "percent = 0.1")
    plan.write_text(content.replace("minimum_ratio = 0.0", "minimum_ratio = 2.0"), encoding="utf-8")
    done = dry_run(BatchRequest(plan, "virtual", Path(), motors=1), bench.fork_server)
    (resistance,) = [limit for limit in done.limits if limit.parameter == "stator_resistance"]
    assert not done.good
    assert resistance.fault
    assert resistance.ratio < 2.0
    assert not next(limit for limit in done.limits if limit.parameter == "pole_pairs").fault


def test_ranges_that_a_plan_leaves_unverified_are_named(bench: Any) -> None:
    plan = bench.folder / "plan.toml"
    plan.write_text(
        """
[plan]
name = "ranges"
motor = "ipmsm"
[[procedure]]
name = "probe-verification"
settings = { voltage_ranges = [16.0], current_ranges = [], settle = 0.05, record_time = 0.02 }
[[procedure]]
name = "back-emf-constant"
settings = { speed_shares = [0.5], winding_temperature = 25.0 }
[[limit]]
parameter = "flux_linkage"
low = 0.014
high = 0.018
""",
        encoding="utf-8",
    )
    done = dry_run(BatchRequest(plan, "virtual", Path(), motors=2), bench.fork_server)
    (said,) = done.unverified
    assert str(said).startswith(
        "back-emf-constant: the verified gain of channel 1, 2, 3 holds at 16 V full scale; records at "
    )
    assert done.as_dict()["unverified"] == [str(said)]


def test_a_limit_that_cannot_be_decided_is_not_said_to_be_missed(bench: Any) -> None:
    plan = bench.folder / "plan.toml"
    content = plan.read_text(encoding="utf-8").replace("percent = 60.0", "low = 0.01599\nhigh = 0.01601")
    content = content.replace('"small"', '"a/../../b"').replace("minimum_ratio = 0.0", "minimum_ratio = 1.0")
    plan.write_text(content, encoding="utf-8")
    done = dry_run(BatchRequest(plan, "virtual", Path(), motors=1), bench.fork_server)
    (resistance,) = [limit for limit in done.limits if limit.parameter == "stator_resistance"]
    assert not 0.01599 <= resistance.value <= 0.01601
    assert str(resistance.fault).startswith("undecidable")
    assert "plan.name = 'a/../../b' cannot be the batch's name, too" in " ".join(map(str, done.notes))


def test_ctrl_c_ends_it_and_no_motors_is_no_number_of_them(bench: Any) -> None:
    request = BatchRequest(bench.folder / "plan.toml", "virtual", Path(), motors=3)
    with pytest.raises(KeyboardInterrupt):
        dry_run(request, bench.fork_server, lambda _done, _all: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(UsageError, match="--motors 0: allowed are"):
        dry_run(replace(request, motors=0), bench.fork_server)
