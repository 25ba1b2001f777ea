"""Access of a run to the virtual bench on which it takes place."""

from typing import TYPE_CHECKING, Any

from bench.i18n.simulated import simulated
from bench.virtual.fault_hooks import FaultListener
from bench.virtual.true_values import MeasuredAt, true_values
from drivers.interfaces.text import lines, text
from drivers.transport.in_process import InProcess
from procedures.core.parameter_definition import ParameterTable
from procedures.core.procedure_error import NotModelledError

if TYPE_CHECKING:
    from bench.virtual.served_world import ServedWorld
    from sim_instruments.bench import VirtualBench
    from sim_instruments.physics.motor.motor import VirtualMotor
    from sim_instruments.six_step.drive import SixStepDrive

#: By how much (s) the clocks of a served bench and of its run may differ.
_CLOCKS = 1e-6


class Simulation:
    """A real bench: nothing is simulated, and only measured values are known.

    `in_process` opens the instruments of a bench in this process.
    """

    in_process: InProcess | None = None

    def true_values(self, definitions: ParameterTable, at: MeasuredAt) -> dict[str, float]:
        """Return the virtual motor's true values of some parameters by name, as they are to be measured; empty if they are not known."""
        return {}

    def step_started(self, step: str, procedure: str) -> None:
        """Be told which step begins: faults may wait for it."""

    def listen_to_faults(self, listener: FaultListener) -> None:
        """Tell `listener` of the faults that begin and mend, where they do in this process."""

    def unfelt_faults(self) -> list[dict[str, Any]]:
        """Return the faults, as they were given, that never began or struck no message."""
        return []

    def actual_state(self) -> dict[str, Any]:
        """Return the actual state of the bench, independent of its instruments' readings; empty if it is not known."""
        return {}

    def check_modelled(self, since: float) -> None:
        """Raise NotModelledError where a virtual bench came into a state since a bench time (s) that it does not model."""
        if found := [what for what, when in self._unmodelled().items() if when >= since - _CLOCKS]:
            raise NotModelledError(
                text(
                    "the virtual bench does not model {what}. Readings in this state are not figures of this motor",
                    what=lines(map(simulated, found), between="; "),
                )
            )

    def _unmodelled(self) -> dict[str, float]:
        result: dict[str, float] = self.actual_state().get("unmodelled", {})
        return result


class InProcessSimulation(Simulation):
    """A virtual bench in this process."""

    def __init__(self, bench: "VirtualBench", motor: "VirtualMotor", drive: "SixStepDrive | None") -> None:
        self.bench = bench
        self.in_process = bench
        self._motor, self._drive = motor, drive

    def true_values(self, definitions: ParameterTable, at: MeasuredAt) -> dict[str, float]:
        """Return the true values of its motor."""
        return true_values(definitions, self._motor, self._drive, at)

    def step_started(self, step: str, procedure: str) -> None:
        """Tell its faults which step begins."""
        self.bench.injector.step_started(step, procedure)

    def listen_to_faults(self, listener: FaultListener) -> None:
        """Tell `listener` of the faults that begin and mend."""
        self.bench.injector.listen(listener)

    def unfelt_faults(self) -> list[dict[str, Any]]:
        """Return those of its faults that nothing has felt."""
        return self.bench.injector.unfelt()

    def actual_state(self) -> dict[str, Any]:
        """Return the state of its world."""
        return self.bench.world.truth()

    def _unmodelled(self) -> dict[str, float]:
        return self.bench.world.unmodelled


class ServedSimulation(Simulation):
    """A virtual bench behind sockets, reached by its control endpoint."""

    def __init__(self, world: "ServedWorld") -> None:
        self._world = world

    def true_values(self, definitions: ParameterTable, at: MeasuredAt) -> dict[str, float]:
        """Return the true values that its server tells, which knows of no procedure: the torque constant is that at no current,
        inductances are those for slow changes.
        """
        return {name: value for name, value in self._world.motor_truth().items() if name in definitions}

    def step_started(self, step: str, procedure: str) -> None:
        """Tell its faults which step begins."""
        self._world.step_started(step, procedure)

    def unfelt_faults(self) -> list[dict[str, Any]]:
        """Return those of its faults that nothing has felt."""
        return self._world.unfelt_faults()

    def actual_state(self) -> dict[str, Any]:
        """Return the state of its world."""
        return self._world.truth()
