"""The virtual bench as a station: the same drivers, by the same way, at the addresses of its instruments."""

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from bench.station.station_file import VIRTUAL, Station, make_station
from procedures.core.nameplate import Nameplate
from sim_instruments.catalogue import DQ_INVERTER
from sim_instruments.physics.motor.motor import VirtualMotor

#: What the virtual units' individual errors are drawn from.
_PROBE_SOURCE = "within the limits of the virtual oscilloscope"
_UNIT_SOURCE = "specification of the virtual unit"
#: A virtual inverter has this bus voltage (V) and this current (A, peak) at least.
_LEAST_BUS, _LEAST_CURRENT = 48.0, 30.0
#: A virtual dynamometer of the usual size holds motors of this torque (N·m); a larger one is rated for so many times the motor's.
_USUAL_TORQUE, _ROOM = 8.0, 1.25
#: Above this bus voltage (V) the voltage probes are those for high voltage.
_HIGH_BUS = 300.0
#: The usual current probe (A per V) shows so much (A, peak); above it the next one is used.
_PROBE, _PROBE_PEAK, _NEXT_PROBE = 10.0, 150.0, 100.0
#: An address as the virtual bench gives it: text, or for a CAN node its parts.
Address = str | Mapping[str, str | int]


class BenchSize(NamedTuple):
    """The size of what a virtual bench has for a motor: the rated torque (N·m) of a dynamometer and the largest current (A) of an
    inverter that are larger than usual, and the current probe (A per V).
    """

    torque: float | None = None
    current_probe: float = _PROBE
    inverter_current: float | None = None


_USUAL = BenchSize()


def describe(
    addresses: Mapping[str, Address],
    control: str = "",
    interlocks: Mapping[str, Mapping[str, Any]] | None = None,
    watchdog_relays: Mapping[str, Mapping[str, Any]] | None = None,
    *,
    dq_inverter: Mapping[str, Any] | None = None,
    size: BenchSize = _USUAL,
) -> dict[str, Any]:
    """Return what the station file of a virtual bench at these addresses (by role) would hold.

    With `dq_inverter`, the ratings of the simulated one, d- and q-axis currents can be commanded of its inverter.
    `control` is the address of the control endpoint of a bench that another process serves, `interlocks` are where its
    safety contacts are read, `watchdog_relays` where its relays with a watchdog are reached.
    """
    probe = {"source": _PROBE_SOURCE}
    # A probe of 10:1 takes 400 V; a drive's terminal reaches two thirds of its bus, either way, and rings beyond.
    high = dq_inverter is not None and dq_inverter["dc_voltage"] > _HIGH_BUS
    voltage = {"kind": "V", **probe, "attenuation": 100.0 if high else 10.0}
    current = {"kind": "A", **probe, "attenuation": size.current_probe}
    options: dict[str, dict[str, Any]] = {
        "supply": {"driver": "keysight-e36300", "channel": 1, "maximum_current": 10.0},
        "lcr_meter": {"driver": "keysight-e4980a"},
        "oscilloscope": {
            "driver": "keysight-infiniivision",
            "probes": {"1": voltage, "2": voltage, "3": voltage, "4": current},
        },
        "dynamometer": {
            "driver": "delta-dyn200",
            "maximum_speed": 630.0,
            "direction_from": "command",
            "torque_accuracy": {"gain": 2.0e-3, "offset": 5.0e-3, "resolution": 1.0e-4, "source": _UNIT_SOURCE},
            "speed_accuracy": {"gain": 2.0e-4, "resolution": 1.0472e-3, "source": _UNIT_SOURCE},
        },
        "voltmeter": {"driver": "keysight-34461a"},
        "tachometer": {"driver": "lutron-tachometer", "accuracy": {"gain": 5.0e-4, "source": _UNIT_SOURCE}},
        "inverter": {
            "driver": "cia402-inverter",
            "maximum_current": 30.0,
            "maximum_frequency": 1000.0,
            "current_scale": 1.0,
            # The virtual drives are set up with one pole pair: a turn is a period of the phases' currents.
            "pole_pairs": 1,
            "field_current": {"object": "0x2000:00", "type": "u32", "scale": 1.0e-3},
            "poll_interval": 0.05,
            "current_accuracy": {"gain": 0.02, "resolution": 0.01, "source": _UNIT_SOURCE},
            "frequency_accuracy": {"gain": 5.0e-5, "resolution": 0.01, "source": _UNIT_SOURCE},
        },
        "drive": {
            "driver": "cia402-six-step",
            "mode": -1,
            "pole_pairs": 1,
            "bus_current": {"object": "0x2010:00", "type": "i32", "scale": 1.0e-3},
            "hall_state": {"object": "0x2011:00", "type": "u8"},
        },
    }
    if dq_inverter is not None:
        options["inverter"] = {
            "driver": DQ_INVERTER,
            "maximum_current": dq_inverter["maximum_current"],
            # Its loop's voltages are means already: more of them a turn would say the same.
            "sample_interval": 0.02,
            "current_accuracy": {"gain": 5.0e-3, "resolution": 1.0e-3, "source": _UNIT_SOURCE},
            "voltage_accuracy": {"gain": 3.0e-3, "resolution": 1.0e-3, "source": _UNIT_SOURCE},
        }
    elif size.inverter_current is not None:
        options["inverter"]["maximum_current"] = size.inverter_current
    if size.torque is not None:
        options["dynamometer"]["rated_torque"] = size.torque
        options["dynamometer"]["torque_accuracy"]["offset"] = 1.0e-3 * size.torque
    if not addresses.keys() <= options.keys():
        options |= _fixture()
    # The virtual bench in process has no watch, for its process cannot leave it on; one computer that plays both is slow.
    on_can_open = {"drive", "rotor_actuator"} if dq_inverter else {"inverter", "drive", "rotor_actuator"}
    for role in on_can_open & options.keys():
        options[role]["heartbeat_time"] = 3.0 if control else 0.0
        # Faults strike what is asked and answered.
        options[role]["process_data"] = False
    options["dynamometer"]["watchdog_time"] = 3.0 if control else 0.0
    if control and "rotor_actuator" in options:
        # Paced time comes in steps: what turns fast overshoots or falls short by a step.
        options["rotor_actuator"]["maximum_speed"] = 5.0
    instruments = {role: {**options[role], "address": as_text(address)} for role, address in addresses.items()}
    station = {"name": "virtual bench", **({"control": control} if control else {})}
    result: dict[str, Any] = {"station": station, "instruments": instruments}
    if interlocks:
        # One computer plays bench and station: its being busy is no open contact.
        result["interlocks"] = {name: {**where, "timeout": 3.0} for name, where in interlocks.items()}
    if watchdog_relays:
        result["watchdog_relays"] = {
            name: {"driver": "beckhoff-bk9000", **where, "watchdog_time": 3.0, "timeout": 1.0}
            for name, where in watchdog_relays.items()
        }
    return result


def _fixture() -> dict[str, dict[str, Any]]:
    from sim_instruments.world.fixture.layout import crosspoints

    return {
        "switch_matrix": {"driver": "keysight-34970a", "fixed": ["A:channel4~"], "crosspoints": crosspoints()},
        "rotor_actuator": {"driver": "cia402-rotor-actuator", "maximum_speed": 60.0, "poll_interval": 0.02},
        "insulation_tester": {"driver": "gwinstek-gpt9800"},
    }


def virtual_station(
    addresses: Mapping[str, Address], dq_inverter: Mapping[str, Any] | None = None, *, size: BenchSize = _USUAL
) -> Station:
    """Return the station; its identity does not depend on the addresses, which differ from start to start."""
    fixed = json.dumps(describe(dict.fromkeys(addresses, "-"), dq_inverter=dq_inverter, size=size), sort_keys=True)
    return make_station(describe(addresses, dq_inverter=dq_inverter, size=size), VIRTUAL, fixed.encode())


def dc_voltage_for(nameplate: Nameplate) -> float:
    """Return the DC link's voltage (V) of a virtual inverter that carries a motor."""
    return max(_LEAST_BUS, nameplate.rated_voltage or 0.0)


def bench_size_for(motor: VirtualMotor, nameplate: Nameplate) -> BenchSize:
    """Return the size of a virtual bench that holds a motor at its largest current, and shows that current."""
    current = nameplate.current_bound * np.exp(1j * np.linspace(0.0, np.pi, 181))
    if motor.flux_map is not None:
        psi_d, psi_q = motor.flux_map.flux(current.real, current.imag)
    else:
        psi_d = motor.flux_linkage_y + motor.d_axis_inductance_y * current.real
        psi_q = motor.q_axis_inductance_y * current.imag
    largest = 1.5 * motor.pole_pairs * float(np.max(psi_d * current.imag - psi_q * current.real))
    return BenchSize(
        None if largest <= _USUAL_TORQUE else _ROOM * largest,
        _PROBE if nameplate.current_bound <= _PROBE_PEAK else _NEXT_PROBE,
        None if nameplate.rated_current <= _LEAST_CURRENT else nameplate.current_bound,
    )


def dq_inverter_for(nameplate: Nameplate) -> Mapping[str, Any]:
    """Return the ratings of a virtual inverter for d- and q-axis currents that carries a motor, larger than the real one if need be."""
    voltage = dc_voltage_for(nameplate)
    current = max(_LEAST_CURRENT, nameplate.current_bound)
    return {
        "dc_voltage": voltage,
        "maximum_current": current,
        "conf": {
            "servo.max_voltage": 1.2 * voltage,
            "servo.max_power_W": 1.5 * voltage * current,
            "servo.override_board_max_power": True,
        },
    }


def virtual_roles(*, fixture: bool = False, six_step: bool = False) -> frozenset[str]:
    """Return the roles that a virtual bench has, with a fixture and with a six-step drive where it has them."""
    from sim_instruments.bench import FIXTURE_ROLES, ROLES

    return frozenset(ROLES) | (frozenset(FIXTURE_ROLES) if fixture else set()) | ({"drive"} if six_step else set())


def as_text(address: Address) -> str:
    """Return an address as a station file has it."""
    if isinstance(address, str):
        return address
    return f"can://{address['interface']}/{address['channel']}?node={address['node_id']}"
