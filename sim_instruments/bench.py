"""The virtual bench: one world, the faces of its instruments, and the endpoints that a client reaches them by."""

from contextlib import ExitStack
from functools import cached_property
from types import TracebackType
from typing import Literal

import numpy as np

from sim_instruments.clock.virtual_clock import BenchClock, VirtualClock
from sim_instruments.faults.injector import Injector
from sim_instruments.faults.line_faults import Faults
from sim_instruments.instruments.cia402.inverter import Cia402Inverter
from sim_instruments.instruments.cia402.power import ObjectServer
from sim_instruments.instruments.cia402.rotor_actuator import Cia402Actuator
from sim_instruments.instruments.cia402.six_step import Cia402SixStep
from sim_instruments.instruments.delta.c2000 import DeltaDrive
from sim_instruments.instruments.delta.dyn200 import Dyn200
from sim_instruments.instruments.errors import Errors
from sim_instruments.instruments.gwinstek.gpt9800 import Gpt9800
from sim_instruments.instruments.keysight.dmm_34461a import Keysight34461A
from sim_instruments.instruments.keysight.e4980a import KeysightE4980A
from sim_instruments.instruments.keysight.e36300 import RATINGS, KeysightE36313A
from sim_instruments.instruments.keysight.infiniivision import KeysightInfiniiVision
from sim_instruments.instruments.keysight.switch_unit_34970a import Keysight34970A
from sim_instruments.instruments.lutron.tachometer import LutronTachometer
from sim_instruments.physics.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.transports.can.buses import fresh_channel
from sim_instruments.transports.can.in_process import CHANNEL, DirectBus, DirectEnd
from sim_instruments.transports.can.node import CanNode
from sim_instruments.transports.connection import Connection, Line
from sim_instruments.transports.modbus.in_process import ModbusStream
from sim_instruments.transports.modbus.rtu import ModbusRtuEndpoint
from sim_instruments.transports.modbus.tcp import ModbusTcpEndpoint
from sim_instruments.transports.modbus.unit import ModbusLine
from sim_instruments.transports.serial.in_process import SerialLine
from sim_instruments.transports.serial.pty import SerialStream
from sim_instruments.transports.visa.library import InProcessVisaLibrary
from sim_instruments.world.fixture.layout import MODULES, crosspoints
from sim_instruments.world.fixture.relay_contacts import RelayContacts
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, Leads, SupplyStage
from sim_instruments.world.world import World

Role = Literal[
    "supply", "lcr_meter", "oscilloscope", "dynamometer", "tachometer", "inverter", "voltmeter", "drive",
    "switch_matrix", "rotor_actuator", "insulation_tester",
]  # fmt: skip
Address = str | dict[str, str | int]

#: The roles that every bench has; "drive" is one more on a bench with a six-step drive, those of a fixture on one with it.
# A role's place decides its instrument's noise, so new ones go to the end.
ROLES: tuple[Role, ...] = (
    "supply", "lcr_meter", "oscilloscope", "dynamometer", "tachometer", "inverter", "voltmeter",
)  # fmt: skip
FIXTURE_ROLES: tuple[Role, ...] = ("switch_matrix", "rotor_actuator", "insulation_tester")
_PLACES: dict[Role, int] = {
    **{role: place for place, role in enumerate(ROLES)},
    "drive": 100,
    "switch_matrix": 101,
    "rotor_actuator": 102,
    "insulation_tester": 103,
}
_INVERTER_NODE, _DRIVE_NODE, _ACTUATOR_NODE = 5, 6, 7
DIRECT_ADDRESSES: dict[str, str] = {
    "dynamometer": "in-process://dynamometer",
    "tachometer": "in-process://tachometer",
}
VISA_ADDRESSES: dict[str, str] = {
    "supply": "TCPIP0::supply::inst0::INSTR",
    "lcr_meter": "TCPIP0::lcr-meter::inst0::INSTR",
    "oscilloscope": "TCPIP0::oscilloscope::inst0::INSTR",
    "voltmeter": "TCPIP0::voltmeter::inst0::INSTR",
    "switch_matrix": "TCPIP0::switch-matrix::inst0::INSTR",
    "insulation_tester": "TCPIP0::insulation-tester::inst0::INSTR",
}


class VirtualBench:
    """A motor on a bench of virtual instruments; a context manager that closes everything it has opened.

    Faces and endpoints come into being when they are first asked for. `seed` decides every noise, each instrument
    drawing its own; `errors` are the individual errors of the instruments. Without `sockets`, dynamometer, tachometer and
    CAN nodes are reached in process by `stream` and `can_bus`: the same bytes and frames, handed over on the caller's thread,
    so that nothing depends on the wall's clock. With them, `line` is how the dynamometer is reached, the tachometer has a
    pseudo-terminal, and the CAN nodes are on `can_channel` of python-can's virtual interface.
    `six_step` is the six-step drive, whose machine `motor` must be; `supply_output` is the supply's that goes to the motor.
    With `fixture` there are a switch matrix, a rotor actuator and an insulation tester in place of hands.
    """

    def __init__(
        self,
        motor: VirtualMotor,
        *,
        seed: int = 0,
        errors: Errors | None = None,
        clock: BenchClock | None = None,
        dynamometer: DynamometerMachine | None = None,
        inverter: InverterStage | None = None,
        supply: SupplyStage | None = None,
        supply_output: int = 1,
        leads: Leads | None = None,
        ambient_temperature: float = 25.0,
        star_point_accessible: bool = False,
        initial_angle: float = 0.0,
        lcr_options: tuple[str, ...] = ("102",),
        scope_bits: int = 8,
        dynamometer_pole_pairs: int = 2,
        dynamometer_rated_torque: float = 5.0,
        inverter_rated_current: float = 10.0,
        annunciator: str = "22",
        sockets: bool = True,
        line: Literal["tcp", "rtu"] = "tcp",
        six_step: SixStepDrive | None = None,
        fixture: bool = False,
    ) -> None:
        self.errors = errors or Errors()
        self.clock: BenchClock = clock or VirtualClock()
        self.world = World(
            motor,
            self.clock,
            seed=seed,
            dynamometer=dynamometer,
            inverter=inverter,
            supply=supply or _supply_stage(supply_output),
            leads=leads or Leads(lcr_resistance=6.0e-3, lcr_inductance=0.2e-6),
            ambient_temperature=ambient_temperature,
            star_point_accessible=star_point_accessible,
            initial_angle=initial_angle,
            six_step=six_step,
            fixture=fixture,
        )
        #: The roles of this bench.
        self.roles: tuple[Role, ...] = ROLES if six_step is None else (*ROLES, "drive")
        #: The channel of every crosspoint by its name, none without a fixture.
        self.crosspoints: dict[str, int] = {}
        if fixture:
            self.roles = (*self.roles, *FIXTURE_ROLES)
            self.crosspoints = crosspoints()
            self._contacts = RelayContacts(self.world, self.crosspoints)
        self._seed = seed
        self._supply_output = supply_output
        self._lcr_options = lcr_options
        self._scope_bits = scope_bits
        self._pole_pairs, self._rated_torque = dynamometer_pole_pairs, dynamometer_rated_torque
        self._rated_current = inverter_rated_current
        self._annunciator = annunciator
        self._sockets = sockets
        self._line_kind = line
        #: The channel of this bench's CAN bus, which no other bench is on.
        self.can_channel = fresh_channel()
        self._open = ExitStack()

    # faces

    @cached_property
    def supply(self) -> KeysightE36313A:
        """The supply's face."""
        return KeysightE36313A(self.world, self._generator("supply"), self.errors.supply, wired=self._supply_output)

    @cached_property
    def lcr_meter(self) -> KeysightE4980A:
        """The bridge's face."""
        return KeysightE4980A(
            self.world, self._generator("lcr_meter"), self.errors.lcr_meter, options=self._lcr_options
        )

    @cached_property
    def oscilloscope(self) -> KeysightInfiniiVision:
        """The oscilloscope's face."""
        face = KeysightInfiniiVision(
            self.world, self._generator("oscilloscope"), self.errors.oscilloscope, bits=self._scope_bits
        )
        self._open.callback(face.close)
        return face

    @cached_property
    def dynamometer(self) -> ModbusLine:
        """The dynamometer's line: the drive is unit 1, the transducer unit 2."""
        generator = self._generator("dynamometer")
        drive = DeltaDrive(self.world, pole_pairs=self._pole_pairs, rated_torque=self._rated_torque)
        self._open.callback(drive.close)
        transducer = Dyn200(self.world, generator, self.errors.dynamometer, rated_torque=self._rated_torque)
        return ModbusLine((drive, transducer), self.clock, generator)

    @cached_property
    def tachometer(self) -> LutronTachometer:
        """The tachometer's face."""
        return LutronTachometer(
            self.world, self._generator("tachometer"), self.errors.tachometer, annunciator=self._annunciator
        )

    @cached_property
    def inverter(self) -> Cia402Inverter:
        """The inverter's face."""
        return Cia402Inverter(self.world, self.errors.inverter, rated_current=self._rated_current)

    @cached_property
    def voltmeter(self) -> Keysight34461A:
        """The voltmeter's face."""
        return Keysight34461A(self.world, self._generator("voltmeter"), self.errors.voltmeter)

    @cached_property
    def drive(self) -> Cia402SixStep:
        """The six-step drive's face. Raises ValueError on a bench without one."""
        return Cia402SixStep(self.world, self._generator("drive"), self.errors.drive)

    @cached_property
    def switch_matrix(self) -> Keysight34970A:
        """The switch unit's face. Raises ValueError on a bench without a fixture."""
        self._check_fixture("switch_matrix")
        return Keysight34970A(self.world, self._generator("switch_matrix"), self._contacts, MODULES)

    @cached_property
    def rotor_actuator(self) -> Cia402Actuator:
        """The rotor actuator's face. Raises ValueError on a bench without a fixture."""
        self._check_fixture("rotor_actuator")
        return Cia402Actuator(self.world)

    @cached_property
    def insulation_tester(self) -> Gpt9800:
        """The insulation tester's face. Raises ValueError on a bench without a fixture."""
        self._check_fixture("insulation_tester")
        return Gpt9800(self.world, self._generator("insulation_tester"), self.errors.insulation_tester)

    def stick_relay(self, crosspoint: str, closed: bool | None) -> None:
        """Have a relay's contact stay closed or open, or mend it with None.

        Raises ValueError for a crosspoint that there is not, or on a bench without a fixture.
        """
        self._check_fixture("switch_matrix")
        self._contacts.stick(crosspoint, closed)

    def check_crosspoint(self, crosspoint: str) -> None:
        """Raise ValueError for a crosspoint that there is not."""
        self._check_fixture("switch_matrix")
        self._contacts.channel(crosspoint)

    def _check_fixture(self, role: Role) -> None:
        if role not in self.roles:
            raise ValueError(f"this bench has no {role}; make it with fixture=True")

    @property
    def faces(self) -> dict[str, object]:
        """Return every face by role."""
        return {role: getattr(self, role) for role in self.roles}

    def faults(self, role: str) -> Faults:
        """Return the faults of a role's line. Raises ValueError for an unknown role."""
        return self._line(role).faults

    def connection(self, role: str) -> Connection:
        """Return the cable of a role's instrument. Raises ValueError for an unknown role."""
        return self._line(role).connection

    @cached_property
    def injector(self) -> Injector:
        """What brings described faults onto this bench."""
        return Injector(self)

    def _line(self, role: str) -> Line:
        match role:
            case "supply":
                return self.supply
            case "lcr_meter":
                return self.lcr_meter
            case "oscilloscope":
                return self.oscilloscope
            case "dynamometer":
                return self.dynamometer
            case "tachometer":
                return self.tachometer
            case "inverter":
                return self._inverter_node
            case "drive" if role in self.roles:
                return self._drive_node
            case "voltmeter":
                return self.voltmeter
            case "switch_matrix" if role in self.roles:
                return self.switch_matrix
            case "rotor_actuator" if role in self.roles:
                return self._actuator_node
            case "insulation_tester" if role in self.roles:
                return self.insulation_tester
        raise ValueError(f"role {role!r} is unknown; the bench has {', '.join(self.roles)}")

    # endpoints

    @cached_property
    def visa_library(self) -> InProcessVisaLibrary:
        """The library to hand to `pyvisa.ResourceManager`."""
        library = InProcessVisaLibrary(
            {address: getattr(self, role) for role, address in VISA_ADDRESSES.items() if role in self.roles}
        )
        self._open.callback(library.shut)
        return library

    @cached_property
    def _dynamometer_endpoint(self) -> ModbusTcpEndpoint | ModbusRtuEndpoint:
        kind = ModbusTcpEndpoint if self._line_kind == "tcp" else ModbusRtuEndpoint
        endpoint = kind(self.dynamometer)
        self._open.callback(endpoint.close)
        return endpoint

    @cached_property
    def _tachometer_endpoint(self) -> SerialStream:
        endpoint = SerialStream(self.tachometer, self.clock, self.tachometer.connection)
        self._open.callback(endpoint.close)
        return endpoint

    @cached_property
    def _tachometer_line(self) -> SerialLine:
        line = SerialLine(self.tachometer, self.clock, self.tachometer.connection)
        self._open.callback(line.shut)
        return line

    @cached_property
    def _direct_can(self) -> DirectBus:
        return DirectBus(self.clock)

    @cached_property
    def _inverter_node(self) -> CanNode:
        return self._can_node(self.inverter, "inverter", _INVERTER_NODE)

    @cached_property
    def _drive_node(self) -> CanNode:
        return self._can_node(self.drive, "drive", _DRIVE_NODE)

    @cached_property
    def _actuator_node(self) -> CanNode:
        return self._can_node(self.rotor_actuator, "rotor_actuator", _ACTUATOR_NODE)

    def _can_node(self, device: ObjectServer, role: Role, node_id: int) -> CanNode:
        node = CanNode(
            device,
            self.clock,
            self._generator(role),
            node_id=node_id,
            channel=self.can_channel,
            direct=None if self._sockets else self._direct_can,
        )
        self._open.callback(node.close)
        return node

    def address(self, role: str) -> Address:
        """Return where a role's instrument is reached, opening its endpoint. Raises ValueError for an unknown role."""
        match role:
            case "supply" | "lcr_meter" | "oscilloscope" | "voltmeter":
                return VISA_ADDRESSES[role]
            case "switch_matrix" | "insulation_tester" if role in self.roles:
                return VISA_ADDRESSES[role]
            case "rotor_actuator" if role in self.roles:
                return self._actuator_node.address
            case "tachometer" if not self._sockets:
                # Streaming from now on, as a switched-on tachometer does.
                _ = self._tachometer_line
                return DIRECT_ADDRESSES[role]
            case "dynamometer" if not self._sockets:
                return DIRECT_ADDRESSES[role]
            case "dynamometer":
                return self._dynamometer_endpoint.address
            case "tachometer":
                return self._tachometer_endpoint.address
            case "inverter":
                return self._inverter_node.address
            case "drive" if role in self.roles:
                return self._drive_node.address
        raise ValueError(f"role {role!r} is unknown; the bench has {', '.join(self.roles)}")

    def addresses(self) -> dict[str, Address]:
        """Return where every instrument is reached."""
        return {role: self.address(role) for role in self.roles}

    def stream(self, address: str) -> ModbusStream | SerialLine:
        """Return the byte stream at an address in process.

        Raises LookupError where there is none, ConnectionError where its cable is out.
        """
        if not self._sockets and address == DIRECT_ADDRESSES["dynamometer"]:
            return ModbusStream(self.dynamometer)
        if not self._sockets and address == DIRECT_ADDRESSES["tachometer"]:
            return self._tachometer_line
        raise LookupError(f"this bench has no {address}")

    def can_bus(self, channel: str) -> DirectEnd:
        """Return an end of the CAN bus in process. Raises LookupError where there is no such channel."""
        if self._sockets or channel != CHANNEL:
            raise LookupError(f"this bench has no CAN channel {channel} in process")
        return self._direct_can.end()

    def close(self) -> None:
        """Close all endpoints, the last one opened first; again is allowed."""
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

    def _generator(self, role: Role) -> np.random.Generator:
        return np.random.default_rng((self._seed, _PLACES[role]))


def _supply_stage(output: int) -> SupplyStage:
    """Return an output of the E36313A; the load regulation of output 1, 2 mV over 10 A, is its output resistance."""
    rating = RATINGS[output]
    return SupplyStage(
        maximum_voltage=rating.voltage * 1.01, maximum_current=rating.current * 1.01, output_resistance=2.0e-4
    )
