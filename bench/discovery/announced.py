"""Instruments that announce themselves by mDNS (LXI: DNS-SD service types)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bench.discovery.inquiry import Inquiry
from bench.station.computer import Computer
from bench.station.connections import lacking
from drivers.interfaces.text import text

#: Service types of the LXI Device Specification, each with how its port is addressed.
SERVICES = {
    "_hislip._tcp.local.": "TCPIP0::{host}::hislip0,{port}::INSTR",
    "_scpi-raw._tcp.local.": "TCPIP0::{host}::{port}::SOCKET",
    "_vxi-11._tcp.local.": "TCPIP0::{host}::inst0::INSTR",
    "_lxi._tcp.local.": "",
}
#: How long (s) answers are waited for: who has just answered somebody else is silent for a second (RFC 6762, 6), and questions are
#: asked at once, after one second and after three.
LISTENING_TIME = 3.5
#: How long (ms) one that was heard of is asked for its address: a question is repeated after 0.2, 0.6 and 1.4 s.
_ASKING_TIME = 1500


@dataclass(frozen=True)
class Service:
    """One announced service: its type, the name it is announced by, and where it is."""

    kind: str
    name: str
    host: str
    port: int

    @property
    def address(self) -> str:
        """Its VISA address; empty for a page (`_lxi`), which is no way to an instrument."""
        return SERVICES[self.kind].format(host=self.host, port=self.port)


def announced(inquiry: Inquiry, computer: Computer, interfaces: Sequence[str] | None = None) -> list[Service]:
    """Return what is announced on these interfaces of this computer (by IP address), on all where none are given."""
    missing = list(lacking("mdns", computer))
    if missing:
        inquiry.skip("mDNS", missing[0])
        return []
    what = text("who announces {kinds}", kinds=[kind.removesuffix(".local.") for kind in SERVICES])
    return inquiry.ask("mDNS", what, lambda: _heard(inquiry, interfaces) or None, LISTENING_TIME + 5.0) or []


def _heard(inquiry: Inquiry, interfaces: Sequence[str] | None) -> list[Service]:
    from zeroconf import InterfaceChoice, IPVersion, ServiceBrowser, ServiceListener, Zeroconf

    class _Names(ServiceListener):
        def __init__(self) -> None:
            self.names: dict[tuple[str, str], None] = {}

        def add_service(self, zc: Zeroconf, type_: str, name: str) -> None:
            self.names[type_, name] = None

        def update_service(self, zc: Zeroconf, type_: str, name: str) -> None:
            self.names[type_, name] = None

        def remove_service(self, zc: Zeroconf, type_: str, name: str) -> None:
            self.names.pop((type_, name), None)

    where = list(interfaces) if interfaces else InterfaceChoice.All
    with Zeroconf(interfaces=where, ip_version=IPVersion.V4Only) as network:
        listener = _Names()
        browser = ServiceBrowser(network, list(SERVICES), listener)
        inquiry.clock.sleep(LISTENING_TIME)
        found = [_service(network, kind, name) for kind, name in list(listener.names)]
        browser.cancel()
    return sorted({one for several in found for one in several}, key=lambda one: (one.host, one.kind, one.port))


def _service(network: "object", kind: str, name: str) -> Iterable[Service]:
    from zeroconf import ServiceInfo, Zeroconf

    info = ServiceInfo(kind, name)
    if not isinstance(network, Zeroconf) or not (info.load_from_cache(network) or info.request(network, _ASKING_TIME)):
        return
    for host in info.parsed_addresses():
        yield Service(kind, name.removesuffix(f".{kind}"), host, info.port or 0)
