"""What a person does at an instrument whose found state a driver refused: the key of the message, and nothing else."""

import re

from drivers.interfaces import InstrumentError
from procedures.core.nameplate import Nameplate
from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.delta.dyn200 import Dyn200Make
from tests.studies.worlds.measured_motor import opened_by

#: A refusal of a found state, as `measured_motor` tells it: figures in it are masked.
BY_NAME = re.compile(r"(?P<role>\w+) after '(?P<query>.+?)': it is set to .+, but .+ is needed: ")
#: A refusal of a transducer that is not as the station file says, with what to compare or to set there.
BY_FILE = re.compile(r"dynamometer after .+(in the station file|with the sensor's display)")
#: An instrument names one wrong setting at a time; none has more that only a person may set.
_ROUNDS = 8
_CHANNELS = (1, 2, 3, 4)
#: Program messages that do at a simulated instrument what the key does.
_KEYS = {
    "OUTP:PAIR?": "OUTP:PAIR OFF",
    "OUTP:TRAC?": "OUTP:TRAC OFF",
    "DISP:PAGE?": "DISP:PAGE MEAS",
    ":CHAN#:IMP?": ";:".join(f"CHAN{number}:IMP ONEM" for number in _CHANNELS),
}
_DRIVE, _TRANSDUCER, _INVERTED = 1, 2, 0x12
#: What a driver may set, and has to give back.
_GIVEN_BACK = {
    "supply": tuple(f"{quantity}:MODE? (@1)" for quantity in ("VOLT", "CURR")),
    "lcr_meter": (
        *("DISP:PAGE?", "INIT:CONT?", "TRIG:SOUR?", "FUNC:DEV1:MODE?", "FUNC:DEV2:MODE?", "AMPL:ALC?"),
        *("CORR:OPEN:STAT?", "CORR:LOAD:STAT?", "CORR:LENG?"),
    ),
    "oscilloscope": (
        *(f"CHAN{number}:{word}?" for number in _CHANNELS for word in ("INV", "BWL", "IMP", "PROB:SKEW")),
        *(f"TRIG:{word}?" for word in ("COUP", "HFR", "NREJ", "HOLD")),
    ),
    "voltmeter": ("VOLT:ZERO:AUTO?", "VOLT:NULL:STAT?", "CALC:SCAL:STAT?"),
}
_REGISTERS = {_DRIVE: (0x091E, 0x0014, 0x0015, 0x0B1B, 0x0B21, 0x0B24, 0x0B25, 0x0B26), _TRANSDUCER: (0x07, 0x1F)}


def press_all(bench: VirtualBench, plate: Nameplate) -> None:
    """Press the keys that instruments name when they are opened, until none names any.

    The transducer is then also of the make that the station file describes. Raises KeyError for a refusal whose key is
    unknown here, RuntimeError where pressing does not help.
    """
    bench.instrument("dynamometer").units[_TRANSDUCER].make = Dyn200Make()
    for _ in range(_ROUNDS):
        refused = _refusals(bench, plate)
        if not refused:
            return
        for role, query in {found.group("role", "query") for reason in refused if (found := BY_NAME.match(reason))}:
            instrument = bench.instrument(role)
            if role == "dynamometer":
                instrument.units[_TRANSDUCER].write(_INVERTED, [0, 0])
            else:
                instrument.write(_KEYS[re.sub(r"\d+", "#", query)].encode() + b"\n")
    raise RuntimeError(f"refused although every key was pressed: {sorted(refused)}")


def _refusals(bench: VirtualBench, plate: Nameplate) -> set[str]:
    """Return why instruments are refused for what was left of them, when they are opened."""
    instruments, told = opened_by(bench, plate), set()
    for role in instruments.available():
        try:
            instruments.open(role)
        except InstrumentError as reason:
            told.add(str(reason))
    instruments.close()
    return {reason for reason in told if BY_NAME.match(reason)}


def settings_of(bench: VirtualBench) -> dict[str, str]:
    """Return the settings that a driver may change and has to give back, as the simulated instruments hold them now."""
    told = {}
    for role, queries in _GIVEN_BACK.items():
        instrument = bench.instrument(role)
        for query in queries:
            instrument.write(query.encode() + b"\n")
            told[f"{role} {query}"] = instrument.read(200, 1.0)[0].decode().strip()
    units = bench.instrument("dynamometer").units
    return told | {
        f"dynamometer unit {unit} {number:04X}H": str(units[unit].read(number, 1)[0])
        for unit, numbers in _REGISTERS.items()
        for number in numbers
    }
