"""The paths of the control endpoint."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal

from pydantic import TypeAdapter

from sim_instruments.bench import Address, VirtualBench
from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.server.control import faults
from sim_instruments.server.control.actions import ACTION
from sim_instruments.server.control.http import Handler, Routes
from sim_instruments.server.control.request import Request, checked
from sim_instruments.server.safety_contacts import SafetyContacts


def control_routes(
    bench: VirtualBench,
    clock: PacedClock,
    addresses: Mapping[str, Mapping[str, Address]],
    pages: Mapping[str, Any],
    contacts: SafetyContacts,
    on_bench: Callable[[Handler], Handler],
) -> Routes:
    """Return what answers each request; `pages` are paths that give the same object at any time.

    `on_bench` has a handler run where the instruments are served; whatever else there is answers without them.
    """

    def time(_: Any = None) -> dict[str, float]:
        return {"time": clock.now(), "speedup": clock.speedup}

    def act(given: Any) -> dict[str, Any]:
        result = checked(ACTION, given).perform(bench.world)
        return {"result": result, "time": clock.now()}

    def clear(_: Any) -> dict[str, Any]:
        faults.clear(bench)
        return faults.listed(bench)

    return {
        "/actions": {"POST": on_bench(act)},
        "/truth": {"GET": on_bench(lambda _: bench.world.truth())},
        "/faults": {
            "GET": on_bench(lambda _: faults.listed(bench)),
            "POST": on_bench(partial(faults.inject, bench)),
            "DELETE": on_bench(clear),
        },
        "/interlocks": {"GET": lambda _: contacts.states(), "POST": partial(_set_contact, contacts)},
        "/steps": {"POST": on_bench(partial(faults.step_started, bench))},
        "/addresses": {"GET": lambda _: addresses},
        "/clock": {"GET": time},
        **{path: {"GET": partial(_unchanged, page)} for path, page in pages.items()},
    }


class Contact(Request):
    """One of the safety contacts closed or opened."""

    name: Literal["emergency_stop", "door"]
    closed: bool


_CONTACT: TypeAdapter[Contact] = TypeAdapter(Contact)


def _set_contact(contacts: SafetyContacts, given: Any) -> dict[str, bool]:
    wanted = checked(_CONTACT, given)
    contacts.set(wanted.name, wanted.closed)
    return contacts.states()


def _unchanged(page: Any, _: Any) -> Any:
    return page
