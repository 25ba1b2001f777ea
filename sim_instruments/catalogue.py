"""Declarations of simulated instruments, and the instruments of the standard virtual bench.

They are found by the entry-point group `motorbench.simulated_instruments`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoints, entry_points
from pkgutil import resolve_name, walk_packages
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import numpy as np

    from sim_instruments.world.fixture.relay_contacts import RelayContacts
    from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, SupplyStage
    from sim_instruments.world.world import World

GROUP = "motorbench.simulated_instruments"
Role = Literal[
    "supply", "lcr_meter", "oscilloscope", "dynamometer", "tachometer", "inverter", "voltmeter", "drive",
    "switch_matrix", "rotor_actuator", "insulation_tester",
]  # fmt: skip
Transport = Literal["visa", "modbus", "serial", "can", "can-fd"]
#: What a station file says of an instrument, by key; ratings (SI units) have the names that options have, `maximum_voltage` ….
Options = Mapping[str, Any]


@dataclass(frozen=True)
class BenchPlace:
    """The place of a simulated instrument: its world, noise, individual errors and options.

    One that is not `connected` stands on the bench and answers, but is not wired to the motor. `contacts` are a fixture's relays,
    `node` is the identifier of one on a CAN bus.
    """

    world: "World"
    generator: "np.random.Generator"
    errors: Any
    options: Options
    connected: bool = True
    contacts: "RelayContacts | None" = None
    node: int = 0


@dataclass(frozen=True)
class SimulatedInstrument:
    """One simulated instrument.

    `make` puts it into a place; written as `module:object` its module is imported when the instrument is first used. It gives
    what the transport serves: for VISA a `ScpiInstrument`, for Modbus a `ModbusLine`, for a serial line what streams frames,
    for CAN an object dictionary, for CAN FD a `FrameDevice`. `machine` gives what of the bench's energy it stands for, by its
    options: a `SupplyStage`, a `DynamometerMachine` or an `InverterStage`. `ratings` are the largest values that it takes, by the
    names of options. `model` says which one of a family it is, where the station's driver serves several; it is filled in with the options.
    """

    name: str
    role: Role
    transport: Transport
    make: str | Callable[[BenchPlace], Any]
    machine: "str | Callable[[Options], SupplyStage | DynamometerMachine | InverterStage] | None" = None
    ratings: Callable[[Options], Mapping[str, float]] = lambda _: {}
    model: str = ""

    def made(self, place: BenchPlace) -> Any:
        """Return the instrument in a place."""
        return (resolve_name(self.make) if isinstance(self.make, str) else self.make)(place)

    def stage(self, options: Options) -> Any:
        """Return what of the bench's energy it stands for; None where it feeds nothing, or nothing but what every bench has."""
        if self.machine is None:
            return None
        return (resolve_name(self.machine) if isinstance(self.machine, str) else self.machine)(options)


@dataclass(frozen=True)
class SimulatedUnit:
    """A simulated instrument on a bench: which one, under which name (its role's where it is empty), and with which options."""

    kind: SimulatedInstrument
    name: str = ""
    options: Options = field(default_factory=dict)

    @property
    def key(self) -> str:
        """The instrument's name on its bench."""
        return self.name or self.kind.role


@cache
def _installed() -> EntryPoints:
    # Every distribution's files are looked at for it.
    return entry_points(group=GROUP)


@cache
def find(name: str) -> SimulatedInstrument:
    """Return an installed simulated instrument. Raises LookupError naming those there are."""
    points = _installed()
    if name not in points.names:
        raise LookupError(f"there is no simulated instrument {name!r}; there are {', '.join(sorted(points.names))}")
    result: SimulatedInstrument = points[name].load()
    return result


def preload() -> None:
    """Import every simulated instrument's module, in a process that will fork others."""
    from sim_instruments import instruments

    for module in walk_packages(instruments.__path__, f"{instruments.__name__}."):
        import_module(module.name)


#: The instruments of every virtual bench, and those of one with a fixture in place of hands, by role.
STANDARD: dict[Role, str] = {
    "supply": "keysight-e36313a",
    "lcr_meter": "keysight-e4980a",
    "oscilloscope": "keysight-infiniivision",
    "dynamometer": "delta-dyn200",
    "tachometer": "lutron-tachometer",
    "inverter": "cia402-inverter",
    "voltmeter": "keysight-34461a",
}
SIX_STEP: dict[Role, str] = {"drive": "cia402-six-step"}
FIXTURE: dict[Role, str] = {
    "switch_matrix": "keysight-34970a",
    "rotor_actuator": "cia402-rotor-actuator",
    "insulation_tester": "gwinstek-gpt9800",
}


#: The inverter of a bench that regulates currents in the rotor's frame.
DQ_INVERTER = "mjbots-moteus"


def standard_units(
    *,
    six_step: bool = False,
    fixture: bool = False,
    dq_inverter: Options | None = None,
    dc_voltage: float | None = None,
    torque: float | None = None,
    inverter_current: float | None = None,
) -> Sequence[SimulatedUnit]:
    """Return the units of a standard virtual bench; with `dq_inverter`, its inverter's options, d and q currents can be commanded.

    `dc_voltage` (V) is the other inverter's DC link, `torque` (N·m) the rated one of a dynamometer and `inverter_current` (A) the largest
    of an inverter that are larger than usual.
    """
    names = {**STANDARD, **(SIX_STEP if six_step else {}), **(FIXTURE if fixture else {})}
    units = {role: SimulatedUnit(find(name)) for role, name in names.items()}
    if dq_inverter is not None:
        units["inverter"] = SimulatedUnit(find(DQ_INVERTER), options=dq_inverter)
    elif dc_voltage is not None:
        larger = {} if inverter_current is None else {"maximum_current": inverter_current}
        units["inverter"] = replace(units["inverter"], options={"dc_voltage": dc_voltage, **larger})
    if torque is not None:
        units["dynamometer"] = replace(units["dynamometer"], options={"maximum_torque": torque})
    return list(units.values())
