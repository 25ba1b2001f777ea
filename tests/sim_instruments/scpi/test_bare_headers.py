"""What takes no data elements refuses them, on every simulated instrument that speaks SCPI."""

from collections.abc import Iterator

import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.scpi.exchange import NoReplyError
from sim_instruments.scpi.instrument import ScpiInstrument

ROLES = ("supply", "lcr_meter", "oscilloscope", "voltmeter", "switch_matrix", "insulation_tester")


@pytest.fixture
def bench(bench_motor: VirtualMotor) -> Iterator[VirtualBench]:
    with VirtualBench(bench_motor, fixture=True, sockets=False) as opened:
        yield opened


def error_of(instrument: ScpiInstrument, message: str) -> int:
    instrument.write(b"*CLS\n")
    instrument.write(message.encode() + b"\n")
    with pytest.raises(NoReplyError):
        instrument.read(1000, 0.1)
    instrument.write(b"SYST:ERR?\n")
    return int(instrument.read(1000, 1.0)[0].split(b",")[0])


@pytest.mark.parametrize("role", ROLES)
def test_a_query_with_words_that_are_none_of_its_own_gives_no_figure(bench: VirtualBench, role: str) -> None:
    instrument = bench.instrument(role)
    assert isinstance(instrument, ScpiInstrument)
    for header in instrument.tree.headers():
        if header.endswith("?"):
            assert error_of(instrument, f"{header.lstrip(':')} NONSENSE,MORE") != 0, header


@pytest.mark.parametrize(
    ("role", "message", "error"),
    [
        ("lcr_meter", "ABOR NOW", -108),
        ("lcr_meter", "TRIG:IMM 1", -108),
        ("supply", "SYST:LOC 1", -108),
        ("supply", "INST CH9", -224),
        ("supply", "CURR:PROT:DEL:STAR SOON", -224),
        ("oscilloscope", "SING 1", -108),
        ("oscilloscope", "CHAN1:COUP HF", -141),
        ("oscilloscope", "CHAN1:SCAL? MAX", -108),
        ("oscilloscope", "CHAN9:SCAL 1", -114),
        ("oscilloscope", "TRIG:SOUR CHAN9", -141),
        ("oscilloscope", "CHAN1:PROT:FOO", -113),
        ("voltmeter", "INIT NOW", -108),
        ("voltmeter", "VOLT:DC:RANG:FOO 1", -113),
        ("switch_matrix", "*OPC 1", -108),
        ("insulation_tester", "MAIN:FUNC FOO", 20),
    ],
)
def test_what_is_refused(bench: VirtualBench, role: str, message: str, error: int) -> None:
    assert error_of(bench.instrument(role), message) == error
