"""The paths of the control endpoint."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from sim_instruments.bench import Address, VirtualBench
from sim_instruments.control import faults
from sim_instruments.control.actions import ACTION
from sim_instruments.control.http import Routes
from sim_instruments.control.request import checked
from sim_instruments.paced_clock import PacedClock


def control_routes(
    bench: VirtualBench,
    clock: PacedClock,
    addresses: Mapping[str, Mapping[str, Address]],
    pages: Mapping[str, Any],
) -> Routes:
    """Return what answers each request; `pages` are paths that give the same object at any time."""

    def time(_: Any = None) -> dict[str, float]:
        return {"time": clock.now(), "speedup": clock.speedup}

    def act(given: Any) -> dict[str, Any]:
        result = checked(ACTION, given).perform(bench.world)
        return {"result": result, "time": clock.now()}

    def clear(_: Any) -> dict[str, Any]:
        faults.clear(bench)
        return faults.listed(bench)

    return {
        "/actions": {"POST": act},
        "/truth": {"GET": lambda _: bench.world.truth()},
        "/faults": {"GET": lambda _: faults.listed(bench), "POST": partial(faults.inject, bench), "DELETE": clear},
        "/steps": {"POST": partial(faults.step_started, bench)},
        "/addresses": {"GET": lambda _: addresses},
        "/clock": {"GET": time},
        **{path: {"GET": partial(_unchanged, page)} for path, page in pages.items()},
    }


def _unchanged(page: Any, _: Any) -> Any:
    return page
