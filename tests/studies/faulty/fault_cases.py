"""Which faults the fault study injects: every kind that the instruments of a procedure can have, at each of its steps."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from bench.plugins.catalogues import installed

#: A motor with a six-step drive, for the procedure that needs one.
DRIVEN_MOTOR = "92bl-30-25l"
ON_CAN = ("inverter", "drive")
WITH_OUTPUT = ("supply", "inverter", "drive", "dynamometer")
#: What a procedure would otherwise need the results of others for.
SETTINGS: Mapping[str, tuple[str, ...]] = {
    "equivalent-resistance": ("loads=[0.3, 0.5, 0.7, 0.9]", "winding_resistance=0.1146", "winding_inductance=0.4353e-3")
}
#: Longer than any driver waits for a reply (s of bench time).
LATE = 60.0
#: How long a fault that mends lasts (s).
SHORT = 2.0

_MESSAGES: Mapping[str, Mapping[str, Any]] = {
    "silence": {"fault": "silence"},
    "silence, once": {"fault": "silence", "count": 1},
    "half a reply, once": {"fault": "half", "count": 1},
    "garbage": {"fault": "garbage"},
    "garbage, once": {"fault": "garbage", "count": 1},
    "late reply, once": {"fault": "late", "count": 1, "delay": LATE},
    "replies one behind": {"fault": "stale", "count": 1},
    "sensor frozen": {"fault": "frozen"},
    "not a number": {"fault": "not_a_number"},
    "9.9E37": {"fault": "overflow"},
}
_WIRING: Mapping[str, Mapping[str, Any]] = {
    "motor unplugged": {"fault": "motor_unplugged"},
    "open phase": {"fault": "open_phase", "terminal": "A"},
    "rotor jam": {"fault": "stuck_rotor"},
    "thermal runaway": {"fault": "thermal_runaway"},
}


@dataclass(frozen=True)
class Case:
    """A fault at a step of a procedure on a motor; `name` is the fault's for tables."""

    motor: str
    procedure: str
    step: str
    name: str
    fault: Mapping[str, Any]

    @property
    def described(self) -> dict[str, Any]:
        """The fault as a file would have it."""
        return {**self.fault, "step": self.step, "procedure": self.procedure}

    @property
    def role(self) -> str:
        """The instrument that has the fault, empty for the motor's and the wiring's."""
        return str(self.fault.get("role", ""))


def cases(
    motor: str,
    procedures: Collection[str] = (),
    steps: Collection[str] = (),
    names: Collection[str] = (),
) -> Iterator[Case]:
    """Give every case, or those of some procedures, steps and faults by the tables' names, in the catalogue's order.

    End-of-line checks are tried where they are named.
    """
    for procedure, kind in installed().procedures.items():
        if procedure not in procedures if procedures else not kind.in_all():
            continue
        roles = sorted(role.value for role in kind.roles)
        used = DRIVEN_MOTOR if "drive" in roles else motor
        for step in kind.steps():
            if steps and step.identifier not in steps:
                continue
            for name, fault in faults_of(roles):
                if not names or name in names:
                    yield Case(used, procedure, step.identifier, name, fault)


def faults_of(roles: Collection[str]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Give the faults that a station of these roles can have, each with its name."""
    for role in roles:
        for name, fault in _of_role(role):
            yield name, {**fault, "role": role}
    if roles:
        yield from _WIRING.items()
    if "supply" in roles:
        yield "CC where CV is expected", {"fault": "current_limited"}


def _of_role(role: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    yield from _MESSAGES.items()
    if role in ("supply", "oscilloscope"):
        yield "wrong channel", {"fault": "wrong_channel"}
    if role == "dynamometer":
        yield "Modbus exception", {"fault": "exception", "pattern": "", "times": "always"}
        yield "Modbus exception, once", {"fault": "exception", "count": 1}
        yield "wrong unit", {"fault": "wrong_unit", "pattern": "", "times": "always"}
    unplugged = ("bus-off", "bus_off") if role in ON_CAN else ("disconnected", "disconnect")
    yield unplugged[0], {"fault": unplugged[1]}
    yield f"{unplugged[0]}, {SHORT:g} s", {"fault": unplugged[1], "duration": SHORT}
    if role in WITH_OUTPUT:
        yield "output stuck on", {"fault": "stuck_output"}
        yield "output stuck on, reported off", {"fault": "stuck_output", "reports": "off"}
    if role in ("dynamometer", "inverter"):
        yield "speed runaway", {"fault": "speed_runaway"}
