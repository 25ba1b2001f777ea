"""A driver that names a simulated instrument which there is not: what it was to be tried on is never quietly another one."""

import json
from pathlib import Path

import pytest

from tests.command_line import Call

#: A bridge that a person reads, so that it answers without a line.
PLUGIN = """
from dataclasses import replace
from drivers.interfaces import Role
from drivers.manual.catalogue import DRIVERS

(BRIDGE,) = (
    replace(one, name="acme-bridge", simulated={simulated!r}) for one in DRIVERS if one.role is Role.LCR_METER
)
"""
STATION = """
[station]
name = "bench"
[plugins]
files = ["acme.py"]
[instruments.lcr_meter]
driver = "acme-bridge"
"""
REHEARSED = ("run", "stator-resistance", "--station", "station.toml", "--motor", "lg-400w", "--rehearse", "--json")
NOT_THERE = "driver acme-bridge names the simulated instrument {}, which does not exist: {}"


@pytest.fixture
def stated(tmp_path: Path) -> Path:
    (tmp_path / "station.toml").write_text(STATION, encoding="utf-8")
    return tmp_path / "acme.py"


@pytest.mark.parametrize(
    ("simulated", "said", "slip"),
    [
        ("keysight-e4890a", NOT_THERE.format("keysight-e4890a", "did you mean keysight-e4980a?"), True),
        ("tonghui-th2832", NOT_THERE.format("tonghui-th2832", "known are: keysight-e4980a"), False),
        (
            "lutron-tachometer",
            "driver acme-bridge names the simulated instrument lutron-tachometer, which is one for tachometer",
            True,
        ),
    ],
)
def test_it_is_refused_in_a_rehearsal_and_told_by_the_check(
    call: Call, stated: Path, simulated: str, said: str, slip: bool
) -> None:
    stated.write_text(PLUGIN.format(simulated=simulated), encoding="utf-8")
    code, out, err = call(*REHEARSED)
    assert code != 0
    assert f"instruments.lcr_meter cannot be rehearsed: {said}; correct Driver(simulated=…)" in " ".join(
        (out + err).split()
    )
    code, out, _ = call("station", "check", "station.toml", "--json")
    told = json.loads(out)
    # The instrument itself is there, and what it is simulated by is no matter to it.
    assert told["instruments"]["lcr_meter"]["error"] is None
    assert told["missing_counterparts"] == {"lcr_meter": {"error": said, "slip": slip}}
    assert (code, told["good"]) == ((1, False) if slip else (0, True))
    _, out, _ = call("station", "check", "station.toml", "--language", "en")
    assert f"  {'✗' if slip else '!'} lcr_meter: {said}; " in out


def test_a_driver_that_names_none_is_rehearsed_with_what_stands_for_it(call: Call, stated: Path) -> None:
    stated.write_text(PLUGIN.format(simulated=""), encoding="utf-8")
    code, out, _ = call(*REHEARSED)
    told = json.loads(out)
    assert (code, told["good"]) == (0, True)
    assert told["differences"][0].startswith("lcr_meter: acme-bridge has no simulated counterpart")
    code, out, _ = call("station", "check", "station.toml", "--json")
    assert (code, json.loads(out)["missing_counterparts"]) == (0, {})


def test_a_plan_is_not_tried_on_another_instrument(call: Call, stated: Path) -> None:
    stated.write_text(PLUGIN.format(simulated="keysight-e4890a"), encoding="utf-8")
    plan = '[plan]\nname = "p"\nmotor = "lg-400w"\nguard = "shared"\n[[procedure]]\nname = "stator-resistance"\n'
    (stated.parent / "plan.toml").write_text(plan, encoding="utf-8")
    code, out, err = call("eol", "check", "plan.toml", "--station", "station.toml", "--each", "0", "--sound", "0")
    assert code != 0
    assert "did you mean keysight-e4980a?" in " ".join((out + err).split())
