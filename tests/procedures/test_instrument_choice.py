"""The note's rules for choosing an instrument, held against what a station has."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from drivers.interfaces import Identity, Role
from procedures.core.bench import Bench
from procedures.techniques.instrument_choice import choose_for_inductance, choose_for_resistance


def station(*others: Role) -> Bench:
    meter = SimpleNamespace(identity=Identity("Maker", "M1"))
    return Bench(cast("Any", {Role.LCR_METER: meter, **dict.fromkeys(others, meter)}), *(cast("Any", None),) * 3)


DIRECT = (Role.SUPPLY, Role.VOLTMETER)


@pytest.mark.parametrize(
    ("bench", "reading", "share", "procedure", "short"),
    [
        (station(*DIRECT), 5.0, 0.001, "stator-resistance", False),
        (station(*DIRECT), 5.0, None, "stator-resistance", False),
        (station(*DIRECT), 0.5, None, "stator-resistance-dc", False),
        (station(), 0.5, None, "stator-resistance", True),
        (station(*DIRECT), 0.03, 0.2, "stator-resistance-dc", False),
        (station(), 0.03, 0.2, "stator-resistance", True),
        (station(), None, None, "stator-resistance", False),
    ],
)
def test_resistance(bench: Bench, reading: float | None, share: float | None, procedure: str, short: bool) -> None:
    choice = choose_for_resistance(bench, reading, share, 0.01)
    assert (choice.procedure, choice.short) == (procedure, short)
    rule = choice.as_finding()["reasons"][0]
    assert ("not known yet" if reading is None else "above 2 Ω" if reading > 2.0 else "below 2 Ω") in rule


@pytest.mark.parametrize(
    ("share", "reading", "procedure"),
    [
        (None, 30e-3, "dq-inductance-extremes"),
        (None, 150e-6, "dq-inductance-time-constant"),
        (0.002, 150e-6, "dq-inductance-extremes"),
        (0.05, 150e-6, "dq-inductance-time-constant"),
    ],
)
def test_inductance(share: float | None, reading: float, procedure: str) -> None:
    bench = station(Role.SUPPLY, Role.OSCILLOSCOPE)
    choice = choose_for_inductance(bench, reading, share, 0.01)
    assert choice.procedure == procedure
    assert ("tens of mH: an RLC meter" if reading > 1e-2 else "bridge at 1 kHz") in str(choice.sentence())
