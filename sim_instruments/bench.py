"""The virtual bench: one world, the simulated instruments on it, and the transports that a client reaches them by."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from types import TracebackType
from typing import Any, Literal

import numpy as np

from sim_instruments.catalogue import FIXTURE, SIX_STEP, STANDARD, BenchPlace, SimulatedUnit, Transport, standard_units
from sim_instruments.clock.virtual_clock import BenchClock, VirtualClock
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.faults.injector import Injector
from sim_instruments.faults.line_faults import Faults
from sim_instruments.found_state import HasFoundState
from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.transports.can.buses import fresh_channel
from sim_instruments.transports.can.frame_node import FrameNode
from sim_instruments.transports.can.in_process import CHANNEL, DirectBus, DirectEnd
from sim_instruments.transports.can.node import CanNode
from sim_instruments.transports.connection import Connection, Line
from sim_instruments.transports.modbus.in_process import ModbusStream
from sim_instruments.transports.modbus.rtu import ModbusRtuEndpoint
from sim_instruments.transports.modbus.tcp import ModbusTcpEndpoint
from sim_instruments.transports.serial.in_process import SerialLine
from sim_instruments.transports.serial.pty import SerialStream
from sim_instruments.transports.visa.library import InProcessVisaLibrary
from sim_instruments.world.fixture.layout import crosspoints
from sim_instruments.world.fixture.relay_contacts import RelayContacts
from sim_instruments.world.machine_data import InverterStage, Leads, SupplyStage
from sim_instruments.world.world import World

Address = str | dict[str, str | int]
#: The roles that every standard bench has, and those of one with a fixture.
ROLES: tuple[str, ...] = tuple(STANDARD)
FIXTURE_ROLES: tuple[str, ...] = tuple(FIXTURE)
# A role's number decides its instrument's noise, and a CAN role's its node.
_NUMBERS: dict[str, int] = {
    **{role: number for number, role in enumerate(STANDARD)},
    **{role: 100 + number for number, role in enumerate((*SIX_STEP, *FIXTURE))},
}
_NODES = {"inverter": 5, "drive": 6, "rotor_actuator": 7}
_FURTHER_NODES = 8
#: Transports whose instruments are nodes of the bench's CAN bus.
CAN_TRANSPORTS = ("can", "can-fd")


@dataclass(frozen=True)
class BenchSetting:
    """The surroundings of the motor: leads, ambient temperature (°C), initial shaft angle (rad), access to the star point, and
    disturbances of the bench.
    """

    leads: Leads = field(default_factory=lambda: Leads(lcr_resistance=6.0e-3, lcr_inductance=0.2e-6))
    ambient_temperature: float = 25.0
    star_point_accessible: bool = False
    initial_angle: float = 0.0
    disturbances: Disturbances = field(default_factory=Disturbances)


class VirtualBench:
    """A motor on a bench of simulated instruments; a context manager that closes everything it has opened.

    `units` are the instruments, those of a standard bench where none are given; several may have one role: the first of a role
    is connected to the motor, the others stand there and answer. Instruments and transports come into being when they are
    first asked for. `seed` decides every noise, each instrument drawing its own; `errors` are their individual errors by role.
    Without `sockets`, Modbus lines, serial lines and CAN nodes are reached in process by `stream` and `can_bus`: the same
    bytes and frames, handed over on the caller's thread, so that nothing depends on the wall's clock. With them, `line` is how
    Modbus lines are reached, serial lines are pseudo-terminals, and the CAN nodes are on `can_channel` of python-can's
    virtual interface. With `hostile`, a seed, every instrument is as a last user may have left it.
    `six_step` is the six-step drive, whose machine `motor` must be; with `fixture` there is one in place of
    hands. Raises ValueError for two units of one name, or a second machine on the shaft.
    """

    def __init__(
        self,
        motor: VirtualMotor,
        units: Sequence[SimulatedUnit] | None = None,
        *,
        seed: int = 0,
        errors: Errors | None = None,
        clock: BenchClock | None = None,
        setting: BenchSetting | None = None,
        sockets: bool = True,
        line: Literal["tcp", "rtu"] = "tcp",
        six_step: SixStepDrive | None = None,
        fixture: bool = False,
        hostile: int | None = None,
    ) -> None:
        if units is None:
            units = standard_units(six_step=six_step is not None, fixture=fixture)
        self._units = {unit.key: unit for unit in units}
        if len(self._units) != len(units):
            raise ValueError(f"two units share a name among {', '.join(unit.key for unit in units)}")
        #: The names of the instruments; a role's own name where there is one of it.
        self.roles: tuple[str, ...] = tuple(self._units)
        self._first: dict[str, str] = {}
        for name, unit in self._units.items():
            self._first.setdefault(unit.kind.role, name)
        self.errors = errors or Errors()
        self.clock: BenchClock = clock or VirtualClock()
        setting = setting or BenchSetting()
        self.world = World(
            motor,
            self.clock,
            seed=seed,
            dynamometer=self._stage("dynamometer"),
            inverter=setting.disturbances.inverter.stage(self._stage("inverter") or InverterStage()),
            supply=setting.disturbances.supply.stage(self._stage("supply") or SupplyStage()),
            leads=setting.leads,
            ambient_temperature=setting.ambient_temperature,
            star_point_accessible=setting.star_point_accessible,
            initial_angle=setting.initial_angle,
            six_step=six_step,
            fixture=fixture,
            disturbances=setting.disturbances,
        )
        #: The channel of every crosspoint by its name, none without a fixture.
        self.crosspoints: dict[str, int] = crosspoints() if fixture else {}
        self._contacts = RelayContacts(self.world, self.crosspoints) if fixture else None
        self._seed = seed
        self._hostile = hostile
        #: What a hostile beginning has left of each instrument that has been asked for, in words.
        self.left: dict[str, tuple[str, ...]] = {}
        self._sockets = sockets
        self._line_kind = line
        self._made: dict[str, Any] = {}
        self._ends: dict[str, Any] = {}
        #: The channel of this bench's CAN bus, which no other bench is on.
        self.can_channel = fresh_channel()
        self._open = ExitStack()

    def instrument(self, name: str) -> Any:
        """Return an instrument by its name or its role. Raises ValueError for one that there is not."""
        key = self._key(name)
        if key not in self._made:
            unit = self._units[key]
            role, connected = unit.kind.role, self._first[unit.kind.role] == key
            if not connected and role in _NODES | {"dynamometer": 0}:
                raise ValueError(f"{key}: one {role} is on the shaft already ({self._first[role]}); a bench has one")
            place = BenchPlace(
                self.world,
                self._generator(key),
                getattr(self.errors, role, None),
                unit.options,
                connected,
                self._contacts,
                self._node_id(key),
            )
            self._made[key] = made = unit.kind.made(place)
            for part in (made, *getattr(made, "units", {}).values()):
                if hasattr(part, "close"):
                    self._open.callback(part.close)
            self._leave(key, made, *getattr(made, "units", {}).values())
        return self._made[key]

    @property
    def instruments(self) -> dict[str, Any]:
        """Return every instrument by its name."""
        return {name: self.instrument(name) for name in self.roles}

    def transport(self, name: str) -> Transport:
        """Return what an instrument is reached by. Raises ValueError for one that there is not."""
        return self._units[self._key(name)].kind.transport

    def stick_relay(self, crosspoint: str, closed: bool | None) -> None:
        """Make a relay's contact stick closed or open, or repair it with None.

        Raises ValueError for a crosspoint that there is not, or on a bench without a fixture.
        """
        self._relays().stick(crosspoint, closed)

    def relay_called(self, crosspoint: str) -> bool:
        """Tell whether a relay's coil has ever been commanded closed. Raises ValueError as `stick_relay` does."""
        return self._relays().channel(crosspoint) in self._relays().called

    def check_crosspoint(self, crosspoint: str) -> None:
        """Raise ValueError for a crosspoint that there is not."""
        self._relays().channel(crosspoint)

    def _relays(self) -> RelayContacts:
        if self._contacts is None:
            raise ValueError("this bench has no switch_matrix; make it with fixture=True")
        return self._contacts

    def faults(self, name: str) -> Faults:
        """Return the faults of an instrument's line. Raises ValueError for one that there is not."""
        return self._line(name).faults

    def connection(self, name: str) -> Connection:
        """Return the cable of an instrument. Raises ValueError for one that there is not."""
        return self._line(name).connection

    @cached_property
    def injector(self) -> Injector:
        """The injector of described faults on this bench."""
        return Injector(self)

    def _line(self, name: str) -> Line:
        key = self._key(name)
        return self._node(key) if self.transport(key) in CAN_TRANSPORTS else self.instrument(key)

    # transports

    @cached_property
    def visa_library(self) -> InProcessVisaLibrary:
        """The library to hand to `pyvisa.ResourceManager`."""
        library = InProcessVisaLibrary(
            {visa_address(name): self.instrument(name) for name in self.roles if self.transport(name) == "visa"}
        )
        self._open.callback(library.shut)
        return library

    def address(self, name: str) -> Address:
        """Return where an instrument is reached, opening its transport. Raises ValueError for one that there is not."""
        key = self._key(name)
        transport = self.transport(key)
        if transport == "visa":
            return visa_address(key)
        if transport in CAN_TRANSPORTS:
            return self._node(key).address
        if self._sockets:
            address: Address = self._end(key).address
            return address
        if transport == "serial":
            # Streaming from now on, as what is switched on does.
            self._end(key)
        return direct_address(key)

    def addresses(self) -> dict[str, Address]:
        """Return where every instrument is reached."""
        return {name: self.address(name) for name in self.roles}

    def stream(self, address: str) -> ModbusStream | SerialLine:
        """Return the byte stream at an address in process.

        Raises LookupError where there is none, ConnectionError where its cable is out.
        """
        for name in () if self._sockets else self.roles:
            if address == direct_address(name) and self.transport(name) in ("modbus", "serial"):
                if self.transport(name) == "modbus":
                    return ModbusStream(self.instrument(name))
                line: SerialLine = self._end(name)
                return line
        raise LookupError(f"this bench has no {address}")

    def can_bus(self, channel: str) -> DirectEnd:
        """Return an end of the CAN bus in process. Raises LookupError where there is no such channel."""
        if self._sockets or channel != CHANNEL:
            raise LookupError(f"this bench has no CAN channel {channel} in process")
        return self._direct_can.end()

    def close(self) -> None:
        """Close all transports, the last one opened first; again is allowed."""
        self._open.close()

    def __enter__(self) -> "VirtualBench":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _key(self, name: str) -> str:
        key = name if name in self._units else self._first.get(name)
        if key is None:
            raise ValueError(f"role {name!r} is unknown; the bench has {', '.join(self.roles)}")
        return key

    def _stage(self, role: str) -> Any:
        unit = self._units.get(self._first.get(role, ""))
        return None if unit is None else unit.kind.stage(unit.options)

    def _end(self, key: str) -> Any:
        """Return what serves a Modbus or a serial line to clients."""
        if key not in self._ends:
            instrument = self.instrument(key)
            end: ModbusTcpEndpoint | ModbusRtuEndpoint | SerialStream | SerialLine
            if self.transport(key) == "modbus":
                end = (ModbusTcpEndpoint if self._line_kind == "tcp" else ModbusRtuEndpoint)(instrument)
                self._open.callback(end.close)
            elif self._sockets:
                end = SerialStream(instrument, self.clock, instrument.connection)
                self._open.callback(end.close)
            else:
                end = SerialLine(instrument, self.clock, instrument.connection)
                self._open.callback(end.shut)
            self._ends[key] = end
        return self._ends[key]

    @cached_property
    def _direct_can(self) -> DirectBus:
        return DirectBus(self.clock)

    def _node_id(self, key: str) -> int:
        """Return the identifier of an instrument on the CAN bus; 0 of one that is not."""
        if self.transport(key) not in CAN_TRANSPORTS:
            return 0
        others = [name for name in self.roles if self.transport(name) in CAN_TRANSPORTS and name not in _NODES]
        return _NODES.get(key) or _FURTHER_NODES + others.index(key)

    def _node(self, key: str) -> CanNode | FrameNode:
        if key not in self._ends:
            direct = None if self._sockets else self._direct_can
            node: CanNode | FrameNode
            if self.transport(key) == "can-fd":
                node = FrameNode(
                    self.instrument(key), self.clock, self._generator(key), channel=self.can_channel, direct=direct
                )
            else:
                node = CanNode(
                    self.instrument(key),
                    self.clock,
                    self._generator(key),
                    node_id=self._node_id(key),
                    channel=self.can_channel,
                    direct=direct,
                )
            self._open.callback(node.close)
            self._leave(key, node)
            self._ends[key] = node
        result: CanNode | FrameNode = self._ends[key]
        return result

    def _leave(self, key: str, *parts: Any) -> None:
        """Have the parts of an instrument be as a last user may have left them, in a hostile beginning."""
        if self._hostile is None:
            return
        generator = np.random.default_rng((self._hostile, *key.encode()))
        told = [word for part in parts if isinstance(part, HasFoundState) for word in part.leave(generator)]
        self.left[key] = (*self.left.get(key, ()), *told)

    def _generator(self, key: str) -> np.random.Generator:
        role = self._units[key].kind.role
        same = [name for name, unit in self._units.items() if unit.kind.role == role]
        seed = (self._seed, _NUMBERS[role], same.index(key)) if same.index(key) else (self._seed, _NUMBERS[role])
        return np.random.default_rng(seed)


def visa_address(name: str) -> str:
    """Return the VISA address of an instrument in process."""
    return f"TCPIP0::{name.replace('_', '-')}::inst0::INSTR"


def direct_address(name: str) -> str:
    """Return the address of a byte stream in process."""
    return f"in-process://{name}"
