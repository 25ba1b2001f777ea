"""Faults as requests to the control endpoint, and messages about which step of a procedure begins."""

from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.catalogue import FAULT
from sim_instruments.server.control.request import Request, checked


class StepBegan(Request):
    """A step of a procedure begins now."""

    step: Annotated[str, Field(min_length=1)]
    procedure: str = ""


STEP: TypeAdapter[StepBegan] = TypeAdapter(StepBegan)


def inject(bench: VirtualBench, given: Any) -> dict[str, Any]:
    """Take a fault, for at once or for its time, and return all."""
    bench.injector.add(checked(FAULT, given))
    return listed(bench)


def step_started(bench: VirtualBench, given: Any) -> dict[str, Any]:
    """Take note of a step and return what time it is on the bench."""
    begun = checked(STEP, given)
    bench.injector.step_started(begun.step, begun.procedure)
    return {"time": bench.clock.now()}


def listed(bench: VirtualBench) -> dict[str, Any]:
    """Return all faults: of the world, by role those of the lines with how often each may still strike, and as they were given."""
    lines = {role: bench.faults(role) for role in bench.roles}
    return {
        "world": bench.world.truth()["faults"],
        "instruments": {
            role: [{"fault": fault.kind.value, "times": fault.times} for fault in faults]
            for role, faults in lines.items()
            if list(faults)
        },
        "disconnected": [role for role in bench.roles if not bench.connection(role).up],
        "injected": bench.injector.listed(),
    }


def clear(bench: VirtualBench) -> None:
    """Take all faults away."""
    bench.injector.clear()
    for role in bench.roles:
        bench.faults(role).clear()
        bench.connection(role).plug()
    bench.world.set_open_phase(None)
    bench.world.set_swapped(None)
    bench.world.set_stuck_rotor(False)
