"""A clock, a VISA library that plays an instrument in process, and a watch on what is left open."""

import gc
import os
import re
import threading
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import pyvisa
from pyvisa import constants, errors, rname
from pyvisa.attributes import AttributesByID
from pyvisa.highlevel import VisaLibraryBase
from pyvisa.util import LibraryPath

Handler = Callable[[str], "bytes | None"]


class SteppingClock:
    """A clock that moves only when someone sleeps."""

    def __init__(self) -> None:
        self.time = 0.0
        self.slept: list[float] = []
        self.on_sleep: Callable[[], None] | None = None

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds
        self.slept.append(seconds)
        if self.on_sleep is not None:
            self.on_sleep()


class Wire:
    """What stands behind one VISA resource: messages in, replies out, and faults."""

    def __init__(self, handler: Handler) -> None:
        self.handler = handler
        self.sent: list[str] = []
        self.replies: deque[bytes] = deque()
        self.lost: dict[str, int] = {}  # command → how many of its replies never come
        self.late: dict[str, int] = {}  # command → how many come only after the next message
        self.withheld: list[bytes] = []
        self.fail_write: dict[str, int] = {}
        self.interrupt: dict[str, int] = {}  # command → how many reads end in Ctrl-C, the reply still to come
        self.interrupted = False
        self.chunk: int | None = None
        self.clears = 0
        self.clear_drops = True

    def write(self, message: str) -> None:
        if take(self.fail_write, message):
            raise errors.VisaIOError(constants.StatusCode.error_connection_lost)
        self.sent.append(message)
        self.replies.extend(self.withheld)
        self.withheld.clear()
        reply = self.handler(message)
        if reply is None or take(self.lost, message):
            return
        if take(self.late, message):
            self.withheld.append(reply)
            return
        self.interrupted = take(self.interrupt, message)
        self.replies.append(reply)

    def read(self, count: int) -> tuple[bytes, constants.StatusCode]:
        if self.interrupted:
            self.interrupted = False
            raise KeyboardInterrupt
        if not self.replies:
            raise errors.VisaIOError(constants.StatusCode.error_timeout)
        reply = self.replies.popleft()
        size = min(count, self.chunk or count)
        if len(reply) > size:
            self.replies.appendleft(reply[size:])
            return reply[:size], constants.StatusCode.success_max_count_read
        return reply, constants.StatusCode.success

    def clear(self) -> None:
        self.clears += 1
        if self.clear_drops:
            self.replies.clear()


def take(counts: dict[str, int], message: str) -> bool:
    """Use up one of the faults foreseen for a message."""
    if counts.get(message, 0) > 0:
        counts[message] -= 1
        return True
    return False


class WireLibrary(VisaLibraryBase):
    """The VISA functions that PyVISA needs, over wires."""

    wires: dict[str, Wire]

    @staticmethod
    def get_library_paths() -> tuple[LibraryPath]:
        return (LibraryPath("unset"),)

    def _init(self) -> None:
        self.wires = {}
        self.open_wires: dict[int, tuple[str, Wire]] = {}
        self.attributes: dict[tuple[int, Any], Any] = {}
        self.handle = 0

    def open_default_resource_manager(self) -> Any:
        self.handle += 1
        return self.handle, constants.StatusCode.success

    def open(self, session: Any, resource_name: str, access_mode: Any = None, open_timeout: Any = None) -> Any:
        name = str(rname.parse_resource_name(resource_name))
        if name not in self.wires:
            raise errors.VisaIOError(constants.StatusCode.error_resource_not_found)
        self.handle += 1
        self.open_wires[self.handle] = (name, self.wires[name])
        return self.handle, constants.StatusCode.success

    def close(self, session: Any) -> Any:
        self.open_wires.pop(session, None)
        return constants.StatusCode.success

    def list_resources(self, session: Any, query: str = "?*::INSTR") -> tuple[str, ...]:
        return tuple(self.wires)

    def read(self, session: Any, count: int) -> Any:
        data, status = self.open_wires[session][1].read(count)
        return data, self.handle_return_value(session, status)

    def write(self, session: Any, data: bytes) -> Any:
        assert data.endswith(b"\n")
        self.open_wires[session][1].write(data.decode("ascii").rstrip("\r\n"))
        return len(data), constants.StatusCode.success

    def clear(self, session: Any) -> Any:
        self.open_wires[session][1].clear()
        return constants.StatusCode.success

    def get_attribute(self, session: Any, attribute: Any) -> Any:
        if attribute == constants.ResourceAttribute.resource_name:
            return self.open_wires[session][0], constants.StatusCode.success
        default = AttributesByID[attribute].default
        return self.attributes.get((session, attribute), default), constants.StatusCode.success

    def set_attribute(self, session: Any, attribute: Any, attribute_state: Any) -> Any:
        self.attributes[session, attribute] = attribute_state
        return constants.StatusCode.success

    def disable_event(self, session: Any, event_type: Any, mechanism: Any) -> Any:
        return constants.StatusCode.success

    def discard_events(self, session: Any, event_type: Any, mechanism: Any) -> Any:
        return constants.StatusCode.success


class Settings:
    """An instrument that remembers what it is told and repeats it when asked, with an error queue."""

    def __init__(self, identity: str, values: dict[str, str] | None = None) -> None:
        self.values = {"*IDN?": identity, "*OPC?": "1", **(values or {})}
        self.errors: deque[str] = deque()
        self.refuse: dict[str, str] = {}  # message → entry in the error queue

    def __call__(self, message: str) -> bytes | None:
        if message in self.refuse:
            self.errors.append(self.refuse[message])
            return None
        if message == "SYST:ERR?":
            return (self.errors.popleft() if self.errors else '+0,"No error"').encode() + b"\n"
        if message in self.values:
            return self.values[message].encode() + b"\n"
        if message.endswith(";*OPC?"):
            self(message.removesuffix(";*OPC?"))
            return b"1\n"
        if (setting := re.fullmatch(r"([^ ?]+) (.*?)(,\(@\d\))?", message)) is not None:
            header, value, channels = setting.groups()
            known = {"ON": "1", "OFF": "0"}.get(value, value)
            self.values[f"{header}? {channels[1:]}" if channels else f"{header}?"] = known
            return None
        if message.endswith("?"):
            self.errors.append('-113,"Undefined header"')
        return None


@pytest.fixture
def clock() -> SteppingClock:
    return SteppingClock()


@pytest.fixture
def settings_class() -> type[Settings]:
    return Settings


@pytest.fixture
def manager() -> Iterator[pyvisa.ResourceManager]:
    library = WireLibrary("unset")
    library._init()
    made = pyvisa.ResourceManager(library)
    yield made
    left = [name for name, _ in library.open_wires.values()]
    made.close()
    assert left == [], f"left open: {left}"


@pytest.fixture
def connect(manager: pyvisa.ResourceManager) -> Callable[[str, Handler], Wire]:
    """Put a handler behind an address; returns the wire to it."""

    def put(address: str, handler: Handler) -> Wire:
        wire = Wire(handler)
        manager.visalib.wires[str(rname.parse_resource_name(address))] = wire
        return wire

    return put


def open_descriptors() -> set[str]:
    """Sockets and terminals this process has open."""
    found = set()
    for number in os.listdir("/proc/self/fd"):
        try:
            target = os.readlink(f"/proc/self/fd/{number}")
        except FileNotFoundError:
            continue
        if target.startswith(("socket:", "/dev/pt")):
            found.add(f"{number} {target}")
    return found


@pytest.fixture(autouse=True)
def nothing_left_open() -> Iterator[None]:
    """Fail on threads, sockets and terminals that a test leaves behind."""
    threads, descriptors = set(threading.enumerate()), open_descriptors()
    yield
    # A collection takes long where many tests are loaded: only what may be garbage is worth one.
    if not (set(threading.enumerate()) <= threads and open_descriptors() <= descriptors):
        gc.collect()
    assert set(threading.enumerate()) <= threads, "a thread is left running"
    assert open_descriptors() <= descriptors, "a connection is left open"
