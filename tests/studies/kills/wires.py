"""What happens on the wires: a proxy before an instrument, and faults of the served bench where none can be in between."""

import random
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from time import monotonic
from typing import Any

from drivers.transport.can.addresses import parse_address
from drivers.transport.can.buses import SharedBus
from tests.studies.kills.held_trials import Plan
from tests.studies.kills.proxy import Disturbance, Proxy
from tests.studies.kills.victim import TRANSPORTS, Victim

READINGS, COMMANDS = ("readings",), ("commands",)
#: Numbers that are none, or of the wrong sort.
ODD = (
    "NAN",
    "-NAN",
    "-0.00000000E+00",
    "+9.90000000E+37",
    "+9.91000000E+37",
    "-INF",
    "",
    "1E999",
    "0x1F",
    "1,2",
    "\xff",
)
MUTE = (Disturbance("mute", "to"), Disturbance("mute", "from"), Disturbance("mute", "both"))
_INVERTER = ("inverter_enabled",)
_ON = {"supply": "output_on", "dynamometer": "dynamometer_enabled", "inverter": "inverter_enabled"}


@dataclass(frozen=True)
class Struck:
    """A disturbance by the proxy as an action."""

    disturbance: Disturbance

    def __call__(self, _: Victim, proxy: Proxy | None, _draw: random.Random) -> float:
        assert proxy is not None
        return proxy.disturb(self.disturbance)


@dataclass(frozen=True)
class Again:
    """A disturbance that heals after some tenths of a second, and comes again some tenths later."""

    disturbance: Disturbance

    def __call__(self, victim: Victim, proxy: Proxy | None, draw: random.Random) -> float:
        assert proxy is not None
        at = proxy.disturb(self.disturbance)
        pauses = draw.uniform(0.0, 0.8), draw.uniform(0.0, 0.8)

        def again() -> None:
            threading.Event().wait(pauses[0])
            proxy.disturb(Disturbance("none"))
            threading.Event().wait(pauses[1])
            borne = not victim.is_ending
            struck = proxy.disturb(self.disturbance)
            if borne:
                # What was borne has begun nothing: the second one has.
                proxy.counted_from = struck

        threading.Thread(target=again, daemon=True).start()
        return at


@dataclass(frozen=True)
class Injected:
    """A fault of the served bench as an action."""

    fault: Mapping[str, Any]

    def __call__(self, victim: Victim, _: Proxy | None, _draw: random.Random) -> float:
        at = monotonic()
        victim.bench.served.world.inject(self.fault)
        return at


def plans(draw: random.Random) -> Iterator[Plan]:
    """Give every case once in a drawn order, and again."""
    while True:
        found = [*_proxied(draw), *_repeated(draw), *_nested(draw), *_replies(draw), *_modbus(draw), *_can(draw)]
        draw.shuffle(found)
        yield from found


def _proxied(draw: random.Random) -> Iterator[Plan]:
    for transport in TRANSPORTS:
        for direction in ("to", "from", "both"):
            yield _wire(draw, transport, Disturbance("mute", direction), borne=False)
            yield _wire(draw, transport, Disturbance("half-close", direction))
        for direction in ("to", "from"):
            for seconds in (0.1, 0.5, 1.0, 2.0, 5.0):
                yield _wire(draw, transport, Disturbance("delay", direction, seconds))
            for seconds in (0.005, 0.05, 0.5):
                yield _wire(draw, transport, Disturbance("drip", direction, seconds))
        for again in (False, True):
            yield _wire(draw, transport, Disturbance("reset", again=again))
    for channel in ("sync", "async"):
        for kind in ("mute", "reset", "half-close"):
            yield _wire(draw, "hislip", Disturbance(kind, channel=channel))


def _repeated(draw: random.Random) -> Iterator[Plan]:
    for transport in TRANSPORTS:
        for disturbance in (Disturbance("reset", again=True), Disturbance("mute")):
            yield Plan(
                f"wire: {disturbance.kind}, heals, and again",
                transport,
                draw.choice((READINGS, COMMANDS)),
                Again(disturbance),
                transport,
                borne=True,
                heals=True,
            )


def _nested(draw: random.Random) -> Iterator[Plan]:
    """Instruments that are mute to the run alone, while inner blocks end by errors that are handled."""
    for transport in TRANSPORTS:
        for mute in MUTE:
            words = f"{transport} mute {mute.direction}"
            yield Plan("errors handled in an inner block", words, ("nested", "1"), Struck(mute), transport, heals=True)
    for delay in (4.0, 6.0, 8.0):
        # Blocks whose ends are slow one after the other.
        fault = {"fault": "late", "role": "supply", "pattern": "", "times": "always", "delay": delay}
        words = f"supply {delay / 20.0:g} s late, inverter mute"
        yield Plan("slow and mute", words, _any(draw), SlowAndMute(fault), "can", heals=True)


@dataclass(frozen=True)
class SlowAndMute:
    """A fault of the served bench, and an instrument that is mute to the run some tenths of a second later."""

    fault: Mapping[str, Any]

    def __call__(self, victim: Victim, proxy: Proxy | None, draw: random.Random) -> float:
        assert proxy is not None
        victim.bench.served.world.inject(self.fault)
        threading.Event().wait(draw.uniform(0.0, 0.4))
        return proxy.disturb(draw.choice(MUTE))


def _wire(draw: random.Random, transport: str, disturbance: Disturbance, *, borne: bool = True) -> Plan:
    words = [transport, disturbance.channel, disturbance.direction if disturbance.kind != "reset" else ""]
    words += [f"{disturbance.seconds:g} s" if disturbance.seconds else "", "and again" if disturbance.again else ""]
    busy = READINGS if TRANSPORTS[transport] == "supply" else draw.choice((READINGS, COMMANDS))
    heals = draw.random() < 0.8
    return Plan(
        f"wire: {disturbance.kind}",
        " ".join(filter(None, words)),
        busy,
        Struck(disturbance),
        transport,
        borne=borne,
        heals=heals,
    )


def _replies(draw: random.Random) -> Iterator[Plan]:
    for transport in ("socket", "hislip"):
        for odd in ODD:
            rewrite = Disturbance("rewrite", "from", rewrite=Rewritten(odd, transport))
            yield Plan(
                "odd replies", f"{transport} {odd!r} to the run", READINGS, Struck(rewrite), transport, borne=True
            )
    for odd in draw.sample(ODD, 5):
        fault = {"fault": "replace", "role": "supply", "pattern": "^:?MEAS", "times": "always", "reply": f"{odd}\n"}
        yield Plan("odd replies", f"{odd!r} to both", READINGS, Injected(fault), borne=True)
    for role in ("supply", "dynamometer", "inverter"):
        for kind in ("not_a_number", "overflow", "frozen", "stale", "garbage", "half"):
            fault = {"fault": kind, "role": role}
            if kind in ("stale", "garbage", "half"):
                fault |= {"pattern": "", "times": draw.choice((1, 3, 10))}
            # What spoils several messages of a role spoils its guardian's too.
            cut_off = (_ON[role],) if fault.get("times") in (3, 10) else ()
            yield Plan(
                "odd replies", f"{role} {kind}", READINGS, Injected(fault), borne=True, cut_off=cut_off, heals=True
            )


@dataclass(frozen=True)
class Rewritten:
    """Puts another text in the place of every number that is a reply."""

    text: str
    transport: str

    def __call__(self, content: bytes) -> bytes:
        text = self.text.encode("latin-1") + b"\n"
        if self.transport == "socket":
            return text if _is_number(content) else content
        # A HiSLIP message has a header of 16 bytes, whose last 8 are the payload's length.
        if content[:2] != b"HS" or content[2] not in (6, 7) or not _is_number(content[16:]):
            return content
        return content[:8] + len(text).to_bytes(8, "big") + text


def _is_number(content: bytes) -> bool:
    try:
        float(content)
    except ValueError:
        return False
    return True


def _modbus(draw: random.Random) -> Iterator[Plan]:
    for code in (1, 2, 3, 4, 5, 6, 8, 10, 11, 77):
        for pattern in ("^read", "^write"):
            fault = {"fault": "exception", "role": "dynamometer", "code": code, "pattern": pattern}
            fault["times"] = draw.choice((1, 5, "always"))
            words = f"{code} on {pattern[1:]}, {fault['times']}"
            # What refuses every write cannot be switched off.
            cut_off = ("dynamometer_enabled",) if fault["times"] == "always" and pattern == "^write" else ()
            yield Plan("Modbus exception", words, COMMANDS, Injected(fault), borne=True, cut_off=cut_off, heals=True)
    for kind in ("wrong_unit", "half", "garbage", "silence"):
        fault = {"fault": kind, "role": "dynamometer", "pattern": "", "times": draw.choice((1, 2, 3))}
        yield Plan("Modbus faults", f"{kind} {fault['times']} times", READINGS, Injected(fault), borne=True)


def _can(draw: random.Random) -> Iterator[Plan]:
    for kind in ("silence", "half", "garbage"):
        for times in (1, 3, "always"):
            fault = {"fault": kind, "role": "inverter", "pattern": "", "times": times}
            cut_off = _INVERTER if times != 1 else ()
            yield Plan(
                "CAN faults", f"{kind} {times}", _any(draw), Injected(fault), borne=True, cut_off=cut_off, heals=True
            )
    for delay in (2.0, 10.0, 40.0):
        fault = {"fault": "late", "role": "inverter", "pattern": "", "times": "always", "delay": delay}
        yield Plan(
            "CAN faults",
            f"late {delay / 20.0:g} s",
            _any(draw),
            Injected(fault),
            borne=True,
            cut_off=_INVERTER,
            heals=True,
        )
    for duration in (None, 2.0, 20.0):
        fault = {"fault": "bus_off", "role": "inverter"} | ({} if duration is None else {"duration": duration})
        words = f"for {duration / 20.0:g} s" if duration else "for good"
        yield Plan("CAN bus-off", words, _any(draw), Injected(fault), borne=True, cut_off=_INVERTER, heals=True)
    for code in (0x0000, 0x1000, 0x2310, 0x3210, 0x8120, 0x8130, 0xFFFF):
        yield Plan("CANopen EMCY", f"{code:04X}", _any(draw), Emergency(code, draw.choice((1, 1, 200))), borne=True)


def _any(draw: random.Random) -> tuple[str, ...]:
    return draw.choice((READINGS, COMMANDS))


@dataclass(frozen=True)
class Emergency:
    """EMCY objects of the inverter's node (CiA 301), as another one on the bus sees them."""

    code: int
    count: int

    def __call__(self, victim: Victim, _: Proxy | None, draw: random.Random) -> float:
        address, node = parse_address(
            victim.bench.served.told["station"]["instruments"]["inverter"]["address"], "the study"
        )
        bus = SharedBus(address, "the study")
        try:
            at = monotonic()
            for _number in range(self.count):
                bus.network.send_message(0x80 + node, self.code.to_bytes(2, "little") + draw.randbytes(6))
                threading.Event().wait(0.002)
            return at
        finally:
            bus.disconnect()
