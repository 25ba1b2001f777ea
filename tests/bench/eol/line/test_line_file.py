"""The station file of a line: what sockets share, what is their own, and what is refused."""

from pathlib import Path
from typing import Any

import pytest

from bench.eol.line.preparation.line_file import load_line
from bench.eol.line.preparation.prepare import prepare
from bench.i18n.errors import InputError, UsageError
from procedures.core.bench import Role

REAL = """
[station]
name = "two benches"
[line]
timeout = 5.0
[instruments.lcr_meter]
driver = "keysight-e4980a"
address = "TCPIP0::10.0.0.9::inst0::INSTR"
[sockets.left.instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::10.0.0.1::inst0::INSTR"
channel = 1
maximum_current = 10.0
[sockets.right.instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::10.0.0.2::inst0::INSTR"
channel = 1
maximum_current = 10.0
"""


def test_a_line_shares_what_stands_outside_its_sockets(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text(REAL, encoding="utf-8")
    line = load_line(str(station), None)
    assert [socket.name for socket in line.sockets] == ["left", "right"]
    assert line.shared == {Role.LCR_METER}
    assert line.timeout == 5.0
    stations = [socket.station for socket in line.sockets if socket.station]
    assert [each.entries[Role.SUPPLY].address.split("::")[1] for each in stations] == ["10.0.0.1", "10.0.0.2"]
    with pytest.raises(UsageError, match="has 2"):
        load_line(str(station), 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[sockets.left.instruments.supply]", "[instruments.supply]", "either the socket's own or shared"),
        ("[sockets.right.instruments.supply]", "[sockets.right.instruments.suply]", "instruments.suply"),
        ("timeout = 5.0", "timeout = -5.0", "line.timeout"),
        ("timeout = 5.0", "shared = ['lcr_meter']", "line.shared goes with"),
    ],
)
def test_a_line_that_is_not_right_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    station = tmp_path / "station.toml"
    station.write_text(REAL.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_line(str(station), None)


def test_a_shared_supply_is_refused_for_its_guardian(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    shared = REAL.replace("[sockets.left.instruments.supply]", "[instruments.supply]")
    station.write_text(shared[: shared.index("[sockets.right")] + "[sockets.left]\n[sockets.right]\n", encoding="utf-8")
    with pytest.raises(InputError, match="feeds energy and cannot be shared"):
        load_line(str(station), None)


def test_sockets_with_relays_of_their_own_and_one_relay_for_two_is_refused(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    relay = 'driver = "beckhoff-bk9000"\naddress = "tcp://10.0.0.9:502"\nroles = ["supply"]\n'
    station.write_text(f"{REAL}\n[sockets.left.watchdog_relays.enable]\n{relay}", encoding="utf-8")
    left, right = (socket.station for socket in load_line(str(station), None).sockets)
    assert left is not None
    assert right is not None
    assert [each.name for each in left.watchdog_relays] == ["enable"]
    assert right.watchdog_relays == ()
    station.write_text(f"{REAL}\n[watchdog_relays.enable]\n{relay}", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"watchdog_relays.enable.address: tcp://10.0.0.9:502 is the address of enable too"
    ):
        load_line(str(station), None)


def test_a_missing_instrument_is_named(bench: Any) -> None:
    station = bench.folder / "station.toml"
    station.write_text(REAL, encoding="utf-8")
    with pytest.raises(InputError, match=r"pole-pairs-back-emf: it needs \[instruments.dynamometer\]"):
        prepare(bench.request.plan, str(station), None)
