"""Instruments that announce themselves by mDNS, and those that a VXI-11 broadcast finds, on loopback."""

import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from pyvisa_py import tcpip
from pyvisa_py.protocols import rpc

from bench.discovery import announced
from bench.discovery.inquiry import Inquiry
from bench.discovery.matching import KnownInstruments
from bench.discovery.scpi import visa_addresses
from bench.safety.ownership.owner import Unowned
from bench.station.clock import SystemClock
from bench.station.computer import Computer
from bench.station.visa_library import StationVisa

LOOPBACK = "127.0.0.1"


class WithoutPackages(Computer):
    """A computer on which nothing of the extras is installed."""

    def missing(self, modules: Any) -> list[str]:
        return list(modules.values())


def inquiry() -> Inquiry:
    return Inquiry(SystemClock(), 20.0, KnownInstruments(()), Unowned(), lambda _: None)


def test_what_is_announced_has_its_address(monkeypatch: pytest.MonkeyPatch) -> None:
    zeroconf = pytest.importorskip("zeroconf", reason="the extra discovery is not installed")
    # Waiting costs no processor.
    monkeypatch.setattr(announced, "LISTENING_TIME", 2.5)
    services = [
        ("_scpi-raw._tcp.local.", 5025),
        ("_hislip._tcp.local.", 4881),
    ]
    network = zeroconf.Zeroconf(interfaces=[LOOPBACK])
    try:
        for kind, port in services:
            addresses = [socket.inet_aton("127.0.0.9")]
            network.register_service(
                zeroconf.ServiceInfo(kind, f"Meter 7.{kind}", port, addresses=addresses), cooperating_responders=True
            )
        # Nobody repeats a datagram that a machine without time to spare has dropped: one scans again.
        for _ in range(4):
            asked = inquiry()
            found = announced.announced(asked, Computer(Path("/nonexistent")), [LOOPBACK])
            if len([one for one in found if one.host == "127.0.0.9"]) == len(services):
                break
    finally:
        network.close()
    assert [str(one.outcome) for one in asked.report.asked] == ["answered"]
    assert {one.address for one in found if one.host == "127.0.0.9"} == {
        "TCPIP0::127.0.0.9::5025::SOCKET",
        "TCPIP0::127.0.0.9::hislip0,4881::INSTR",
    }
    assert {one.name for one in found if one.host == "127.0.0.9"} == {"Meter 7"}


def test_a_page_is_no_way_to_an_instrument() -> None:
    assert announced.Service("_vxi-11._tcp.local.", "x", "192.0.2.1", 111).address == "TCPIP0::192.0.2.1::inst0::INSTR"
    assert announced.Service("_lxi._tcp.local.", "x", "192.0.2.1", 80).address == ""


def test_without_the_extra_it_says_what_to_install() -> None:
    asked = inquiry()
    assert announced.announced(asked, WithoutPackages()) == []
    (place,) = asked.report.unlooked
    assert (place.where, str(place.why)) == (
        "mDNS",
        "zeroconf not installed; run uv sync --extra discovery, or pip install 'motorbench[discovery]'",
    )


@pytest.fixture
def portmapper(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[bytes]]:
    """A VXI-11 instrument's portmapper on loopback (RFC 1833: PMAPPROC_GETPORT); gives the calls that it got."""
    calls: list[bytes] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind((LOOPBACK, 0))

        def serve() -> None:
            while True:
                with suppress(OSError):
                    call, who = server.recvfrom(1000)
                    if not call:
                        return
                    calls.append(call)
                    # Accepted, no credentials, success; the port of the device's core channel.
                    server.sendto(call[:4] + struct.pack(">6I", 1, 0, 0, 0, 0, 1024), who)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        snic = SimpleNamespace(family=socket.AF_INET, address=LOOPBACK, netmask="255.255.255.255")
        monkeypatch.setattr(tcpip, "time", SimpleNamespace(sleep=lambda _: time.sleep(0.1)))  # noqa: TID251  shorter than a second
        monkeypatch.setattr(rpc, "PMAP_PORT", server.getsockname()[1])
        monkeypatch.setattr(tcpip, "psutil", SimpleNamespace(net_if_addrs=lambda: {"lo": [snic]}))
        yield calls
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ending:
            ending.sendto(b"", server.getsockname())
        thread.join()


def test_a_broadcast_finds_an_instrument_that_speaks_vxi_11(portmapper: list[bytes]) -> None:
    asked, visa = inquiry(), StationVisa("@py")
    try:
        found = visa_addresses(asked, visa)
    finally:
        visa.close()
    assert "TCPIP::127.0.0.1::INSTR" in found
    # Program 395183, the core channel of VXI-11, and nothing else.
    assert [struct.unpack(">4I", call[-16:])[0] for call in portmapper] == [395183]
    assert not any(address.upper().startswith(("ASRL", "PRLGX")) for address in found)
