"""What a run has to do with the virtual bench on which it takes place."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bench.virtual.fault_hooks import FaultListener
from drivers.transport.in_process import InProcess

if TYPE_CHECKING:
    from bench.virtual.served_world import ServedWorld
    from sim_instruments.bench import VirtualBench


class Simulation:
    """A real bench: nothing is simulated, and nothing is known but what is measured.

    `true_values` are the virtual motor's, by parameter name; `in_process` opens the instruments of a bench in this process.
    """

    in_process: InProcess | None = None

    def __init__(self, true_values: Mapping[str, float] | None = None) -> None:
        self.true_values = dict(true_values or {})

    def step_started(self, step: str, procedure: str) -> None:
        """Be told which step begins: faults may wait for it."""

    def listen_to_faults(self, listener: FaultListener) -> None:
        """Have `listener` told of the faults that begin and mend, where they do in this process."""

    def actual_state(self) -> dict[str, Any]:
        """Return the state of the bench, whatever its instruments say; empty where nobody knows."""
        return {}


class InProcessSimulation(Simulation):
    """A virtual bench in this process."""

    def __init__(self, bench: "VirtualBench", true_values: Mapping[str, float]) -> None:
        super().__init__(true_values)
        self.bench = bench
        self.in_process = bench

    def step_started(self, step: str, procedure: str) -> None:
        """Tell its faults which step begins."""
        self.bench.injector.step_started(step, procedure)

    def listen_to_faults(self, listener: FaultListener) -> None:
        """Have `listener` told of the faults that begin and mend."""
        self.bench.injector.listen(listener)

    def actual_state(self) -> dict[str, Any]:
        """Return the state of its world."""
        return self.bench.world.truth()


class ServedSimulation(Simulation):
    """A virtual bench behind sockets, reached by its control endpoint."""

    def __init__(self, world: "ServedWorld") -> None:
        super().__init__(world.motor_truth())
        self._world = world

    def step_started(self, step: str, procedure: str) -> None:
        """Tell its faults which step begins."""
        self._world.step_started(step, procedure)

    def actual_state(self) -> dict[str, Any]:
        """Return the state of its world."""
        return self._world.truth()
