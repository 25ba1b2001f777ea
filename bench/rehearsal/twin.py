"""The virtual twin of a station: the same roles and limits, the drivers of the virtual bench, and the motor or a plausible one."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Any

from bench.motor.motor_file import MotorFile
from bench.operators.virtual import VirtualOperator
from bench.rehearsal.assumed import Assumption, assumed_drive, assumed_motor
from bench.run.context import Place
from bench.station.station_file import Entry, Station
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import ProbeKind
from drivers.interfaces.text import Text, text
from drivers.keysight.options import Probe
from procedures.core.bench import Role
from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.keysight.e36300 import RATINGS
from sim_instruments.six_step.machine import virtual_motor
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage

#: What a driver's options say of the real unit and its wires, which the virtual one has otherwise.
_OF_THE_UNIT = frozenset(
    {
        "serial_number", "drive_unit", "transducer_unit", "direction_from", "current_scale", "heartbeat_time",
        "heartbeat_node", "watchdog_time", "poll_interval", "settle_interval", "calibration",
    }
)  # fmt: skip
#: What an instrument of another make allows, which bounds the virtual one too.
_BOUNDS = (
    "maximum_voltage",
    "maximum_current",
    "maximum_frequency",
    "maximum_speed",
    "maximum_torque",
    "maximum_level",
)
_ATTENUATION = 10.0
#: Largest current (A) that the virtual inverter's torque objects hold.
_INVERTER_RATED = 10.0


@dataclass(frozen=True)
class Twin:
    """Where a rehearsal takes place, the figures of the motor that were assumed, and where twin and station differ."""

    place: Place
    assumed: tuple[Assumption, ...]
    differences: tuple[Text, ...]


@contextmanager
def twin_of(station: Station, motor: MotorFile, seed: int) -> Iterator[Twin]:
    """Give the twin; nothing of the station is opened. Raises InputError for a motor file that does not go with a drive."""
    from pyvisa import ResourceManager

    assumed: tuple[Assumption, ...] = ()
    truth, six_step = motor.virtual, motor.six_step
    if truth is None:
        truth, assumed = assumed_motor(motor.nameplate)
    if Role.DRIVE in station.entries and six_step is None:
        six_step, more = assumed_drive(truth, motor.nameplate)
        truth, assumed = virtual_motor(six_step), (*assumed, *more)
    stages = _stages(station)
    with VirtualBench(truth, seed=seed, six_step=six_step, sockets=False, **stages) as bench:
        virtual = virtual_station(bench.addresses())
        entries, differences = {}, list[Text]()
        for role, entry in station.entries.items():
            if role not in virtual.entries:
                differences.append(
                    text("{role}: the twin has none; what it does, virtual hands do there", role=role.value)
                )
                continue
            entries[role] = _entry(entry, virtual.entries[role], stages)
            differences += _differences(entry, entries[role])
        hands = VirtualOperator(bench.world, seed)
        place = Place(
            replace(station, entries=entries, way_down=replace(station.way_down, by_hand=frozenset()), control=""),
            bench.clock,
            hands,
            lambda _: None,
            lambda: ResourceManager(bench.visa_library),
            {},
            lambda: hands.hand_time,
            in_process=bench,
        )
        yield Twin(place, assumed, tuple(differences))


def _stages(station: Station) -> dict[str, Any]:
    """Return what of the virtual bench's instruments follows from the station's options."""
    made: dict[str, Any] = {}
    options: dict[Role, Any] = {role: entry.options for role, entry in station.entries.items()}
    if (supply := options.get(Role.SUPPLY)) is not None:
        made["supply_output"] = _output(supply)
    if (machine := options.get(Role.DYNAMOMETER)) is not None:
        torque = getattr(machine, "rated_torque", None) or getattr(machine, "maximum_torque", None) or 5.0
        made["dynamometer"] = DynamometerMachine(maximum_speed=machine.maximum_speed, maximum_torque=2.0 * torque)
        made["dynamometer_rated_torque"] = torque
        made["dynamometer_pole_pairs"] = getattr(machine, "pole_pairs", 1)
    if (drive := options.get(Role.INVERTER)) is not None:
        made["inverter"] = InverterStage(
            maximum_current=drive.maximum_current,
            maximum_frequency=drive.maximum_frequency,
            frequency_ramp=max(20.0, drive.maximum_frequency / 50.0),
        )
        made["inverter_rated_current"] = max(_INVERTER_RATED, drive.maximum_current / 3.0)
    return made


def _output(options: Any) -> int:
    """Return the virtual supply's output that is nearest to the station's: its number, else the one with enough voltage."""
    channel = getattr(options, "channel", None)
    if channel in RATINGS:
        return int(channel)
    wanted = options.maximum_voltage or 0.0
    return 1 if wanted <= RATINGS[1].voltage else 2


def _entry(entry: Entry, virtual: Entry, stages: Mapping[str, Any]) -> Entry:
    """Return a role's instrument on the twin: the virtual unit, with the station's options, name and limits."""
    given: dict[str, Any] = {}
    options: Any = virtual.options
    own = {option.name for option in fields(options)}
    if entry.driver.name == virtual.driver.name:
        given = {name: getattr(entry.options, name) for name in own - _OF_THE_UNIT}
    else:
        for name in own.intersection(_BOUNDS):
            bound = getattr(entry.options, name, None)
            if bound is not None:
                given[name] = bound
        if "probes" in own and getattr(entry.options, "probes", None):
            given["probes"] = _probes(entry.options)
        if "channel" in own:
            given["channel"] = stages.get("supply_output", 1)
        if "rated_torque" in own:
            given |= {name: stages[f"dynamometer_{name}"] for name in ("rated_torque", "pole_pairs")}
    return replace(virtual, options=replace(options, **given), name=entry.name, limits=entry.limits)


def _probes(options: Any) -> dict[int, Probe]:
    return {channel: Probe(ProbeKind(kind), _ATTENUATION) for channel, kind in options.probes.items()}


def _differences(entry: Entry, made: Entry) -> Iterator[Text]:
    """Say where the twin's instrument cannot do as the station's would."""
    role = entry.role.value
    if entry.driver.name != made.driver.name:
        yield text(
            "{role}: {virtual} stands for the station's {real}",
            role=role,
            virtual=made.driver.name,
            real=entry.driver.name,
        )
    if entry.role is Role.SUPPLY:
        channel = made.options.channel  # type: ignore[attr-defined]
        rating = RATINGS[channel]
        yield text(
            "{role}: the station file names no model; output {channel} of an E36313A is taken, at most {voltage:g} V and {current:g} A",
            role=role,
            channel=channel,
            voltage=rating.voltage,
            current=rating.current,
        )
        for name, bound, unit in (("maximum_voltage", rating.voltage, "V"), ("maximum_current", rating.current, "A")):
            wanted = getattr(entry.options, name, None)
            if wanted is not None and wanted > bound:
                yield text(
                    "{role}: the station's {name} is {wanted:g} {unit}, the twin's supply ends at {bound:g} {unit}; set points "
                    "that follow the supply's range stand at the twin's",
                    role=role,
                    name=name,
                    wanted=wanted,
                    unit=unit,
                    bound=bound,
                )
