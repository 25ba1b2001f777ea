"""Settings kept and brought back: *SAV, *RCL, *LRN?, *PSC and the bridge's registers."""

from collections.abc import Callable, Iterator

import pytest
import pyvisa

from sim_instruments.bench import VirtualBench
from tests.sim_instruments.motors import BENCH_MOTOR

Session = pyvisa.resources.MessageBasedResource
Opened = Callable[[str], Session]

#: By role: what is set, how it is told, and the messages that save and recall it.
CASES = {
    "voltmeter": (
        ("CONF:RES 1E4,1E-2", "VOLT:NPLC 0.2", "RES:NULL:VAL 5;STAT ON", "TRIG:SOUR BUS;COUN 3", "CURR:TERM 10"),
        ("FUNC?", "CONF?", "VOLT:NPLC?", "RES:NULL:VAL?;STAT?", "TRIG:SOUR?;COUN?", "CURR:RANG?", "VOLT:RANG:AUTO?"),
        ("*SAV 2", "*RCL 2"),
    ),
    "supply": (
        (
            "VOLT 3,(@1);:VOLT 5,(@2:3);:CURR 0.5,(@1:3)",
            "CURR:PROT:STAT ON,(@1)",
            "OUTP:PAIR PAR",
            "INST CH2",
            "OUTP ON,(@1)",
        ),
        ("VOLT? (@1:3)", "CURR? (@1:3)", "CURR:PROT:STAT? (@1:3)", "OUTP:PAIR?", "INST?", "OUTP? (@1:3)"),
        ("*SAV 0", "*RCL 0"),
    ),
    "lcr_meter": (
        (
            "FUNC:IMP LSRS",
            "FREQ 2E3",
            "CURR 5E-3",
            "APER LONG,4",
            "LIST:FREQ 1E3,1E4",
            "TRIG:SOUR BUS",
            "CORR:SHOR:STAT ON",
        ),
        ("FUNC:IMP?", "FREQ?", "CURR?", "APER?", "LIST:FREQ?", "TRIG:SOUR?", "CORR:SHOR:STAT?"),
        ("MMEM:STOR:STAT 7", "MMEM:LOAD:STAT 7"),
    ),
    "switch_matrix": (("ROUT:CLOS (@111,122)",), ("ROUT:CLOS? (@111,122,112)",), ("*SAV 5", "*RCL 5")),
}


@pytest.fixture
def opened() -> Iterator[Opened]:
    with VirtualBench(BENCH_MOTOR, seed=1, fixture=True) as bench:
        manager = pyvisa.ResourceManager(bench.visa_library)
        yield lambda role: manager.open_resource(bench.address(role), read_termination="\n", write_termination="\n")


@pytest.mark.parametrize("role", CASES)
def test_a_place_keeps_the_settings(opened: Opened, role: str) -> None:
    settings, queries, (save, recall) = CASES[role]
    session = opened(role)
    for message in settings:
        session.write(message)
    before = [session.query(query) for query in queries]
    session.write(f"{save};*RST")
    assert [session.query(query) for query in queries[:1]] != before[:1]
    session.write(recall)
    assert [session.query(query) for query in queries] == before
    assert session.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize("role", ["voltmeter", "lcr_meter"])
def test_what_is_learnt_can_be_sent_back(opened: Opened, role: str) -> None:
    settings, queries, _ = CASES[role]
    session = opened(role)
    for message in settings:
        session.write(message)
    before, learnt = [session.query(query) for query in queries], session.query("*LRN?")
    session.write("*RST")
    session.write(learnt)
    assert [session.query(query) for query in queries] == before
    assert session.query("SYST:ERR?") == '+0,"No error"'


@pytest.mark.parametrize(
    ("role", "message", "error"),
    [
        ("voltmeter", "*RCL 1", 291),
        ("voltmeter", "*SAV 5", -222),
        ("voltmeter", "*SAV", -109),
        ("supply", "*RCL 10", -222),
        ("supply", "*LRN?", -113),
        ("switch_matrix", "*RCL 0", 291),
        ("switch_matrix", "*LRN?", -113),
        ("lcr_meter", "*SAV 1", -113),
        ("lcr_meter", "MMEM:LOAD:STAT 3", -230),
        ("lcr_meter", "*PSC 1", -113),
    ],
)
def test_what_is_refused(opened: Opened, role: str, message: str, error: int) -> None:
    session = opened(role)
    session.write(message)
    assert int(session.query("SYST:ERR?").split(",")[0]) == error


@pytest.mark.parametrize("role", ["voltmeter", "supply", "switch_matrix"])
def test_power_on_clear(opened: Opened, role: str) -> None:
    session = opened(role)
    assert session.query("*PSC?") == "+1"
    assert session.query("*PSC 0;*PSC?") == "+0"
