"""One socket of a virtual line: its own world for every motor, its own time, and units of which some are the others' too."""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from bench.operators.virtual import VirtualOperator
from bench.run.context import Place, with_fixture
from bench.station.sharing import Sharing
from bench.station.station_file import Station
from bench.virtual.true_values import truth_of
from bench.virtual.virtual_station import Address, virtual_station
from procedures.core.bench import Role
from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.errors import Errors

if TYPE_CHECKING:
    from pyvisa import ResourceManager

    from sim_instruments.physics.motor import VirtualMotor
    from sim_instruments.six_step.drive import SixStepDrive


def units(seed: int, socket: int, shared: Collection[Role]) -> Errors:
    """Return the individual errors of a socket's units: of the shared ones the same in every socket."""
    own, common = (Errors.drawn(np.random.default_rng([seed, unit])) for unit in (socket + 1, 0))
    names = {role.value for role in shared}
    return Errors(**{each.name: getattr(common if each.name in names else own, each.name) for each in fields(Errors)})


class Stations:
    """Descriptions of virtual benches, each made once: one bench is like another."""

    def __init__(self) -> None:
        self._made: dict[tuple[tuple[str, str], ...], Station] = {}

    def at(self, addresses: Mapping[str, Address]) -> Station:
        """Return the station of a bench at these addresses, by role."""
        key = tuple((role, str(address)) for role, address in addresses.items())
        if key not in self._made:
            self._made = {key: virtual_station(addresses)}
        return self._made[key]


@contextmanager
def virtual_place(
    truth: "VirtualMotor",
    six_step: "SixStepDrive | None",
    errors: Errors,
    seed: int,
    advanced: Callable[[float], None],
    sharing: Callable[[VirtualBench], Sharing],
    *,
    fixture: bool,
    station: Callable[[Mapping[str, Address]], Station],
) -> Iterator[Place]:
    """Give the surroundings for one motor; `advanced` hears the bench's time (s) as it goes on.

    With `fixture`, relays and an actuator work in place of virtual hands. `station` describes a bench at these addresses.
    """
    with VirtualBench(truth, seed=seed, errors=errors, six_step=six_step, sockets=False, fixture=fixture) as bench:
        hands = VirtualOperator(bench.world, seed)
        bench.clock.on_advance(advanced)

        def visa() -> "ResourceManager":
            from pyvisa import ResourceManager

            return ResourceManager(bench.visa_library)

        made = Place(
            station(bench.addresses()),
            bench.clock,
            hands,
            lambda _: None,
            visa,
            truth_of(truth, six_step),
            lambda: hands.hand_time,
            in_process=bench,
            step_started=bench.injector.step_started,
            listen_to_faults=bench.injector.listen,
            really=bench.world.truth,
            sharing=sharing(bench),
        )
        yield with_fixture(made, lambda: float(bench.world.truth()["winding_temperature"])) if fixture else made
