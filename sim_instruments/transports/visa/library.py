"""A PyVISA backend in process: resource names lead straight to faces."""

import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol
from uuid import uuid4

from pyvisa import constants, rname
from pyvisa.constants import ResourceAttribute, StatusCode
from pyvisa.errors import VisaIOError
from pyvisa.highlevel import VisaLibraryBase
from pyvisa.typing import VISAEventContext, VISARMSession, VISASession
from pyvisa.util import LibraryPath

from sim_instruments.scpi.exchange import NoReplyError, ReadEnd
from sim_instruments.transports.connection import Connection

_STATUS = {
    ReadEnd.MESSAGE: StatusCode.success,
    ReadEnd.COUNT: StatusCode.success_max_count_read,
    ReadEnd.TERMINATION: StatusCode.success_termination_character_read,
}
_DEFAULT_TIMEOUT = 2000


class MessageDevice(Protocol):
    """The interface of a simulated instrument for a message-based transport."""

    @property
    def connection(self) -> Connection:
        """Return its cable."""

    def write(self, data: bytes, end: bool = True) -> None:
        """Take bytes of a message."""

    def read(self, count: int, timeout: float | None, termination: int | None = None) -> tuple[bytes, ReadEnd]:
        """Return bytes of the response."""

    def clear(self) -> None:
        """Device clear."""

    def status_byte(self) -> int:
        """Return the status byte, as a serial poll would."""

    def bus_trigger(self) -> None:
        """Trigger of the bus."""


@dataclass(slots=True)
class _Session:
    device: MessageDevice
    connection: Connection
    pulled: int
    attributes: dict[int, Any] = field(default_factory=dict)
    timeout: float | None = _DEFAULT_TIMEOUT / 1000.0
    termination: int | None = None
    end: bool = True


class InProcessVisaLibrary(VisaLibraryBase):
    """Hand an instance to `pyvisa.ResourceManager`; `close` it in the end, which closes the manager too."""

    _devices: dict[str, MessageDevice]
    _sessions: dict[int, _Session]
    _handles: "itertools.count[int]"

    def __new__(cls, devices: Mapping[str, MessageDevice]) -> "InProcessVisaLibrary":
        """Return a library of its own, with `devices` under their resource names."""
        # PyVISA shares libraries of equal path, so each one gets a path that no other has.
        library = super().__new__(cls, LibraryPath(f"virtual-bench-{uuid4().hex}", "in process"))
        assert isinstance(library, InProcessVisaLibrary)  # noqa: S101  (narrows the type that PyVISA declares)
        library._devices = {_canonical(name): device for name, device in devices.items()}
        library._sessions = {}
        library._handles = itertools.count(1)
        return library

    def __init__(self, devices: Mapping[str, MessageDevice]) -> None:
        """Everything is done in __new__, as PyVISA wants it."""

    def shut(self) -> None:
        """Close the resource manager and all sessions and leave PyVISA's registry."""
        if self.resource_manager is not None:
            self.resource_manager.close()
        self._sessions.clear()
        VisaLibraryBase._registry.pop((type(self), self.library_path), None)

    @property
    def sessions(self) -> int:
        """The number of open resources."""
        return len(self._sessions)

    def _session(self, session: int) -> _Session:
        try:
            return self._sessions[session]
        except KeyError:
            raise VisaIOError(StatusCode.error_invalid_object) from None

    def _connected(self, session: int) -> _Session:
        entry = self._sessions.get(session)
        if entry is None:
            raise VisaIOError(StatusCode.error_invalid_object)
        if not entry.connection.up or entry.connection.pulled != entry.pulled:
            raise VisaIOError(StatusCode.error_connection_lost)
        return entry

    # what PyVISA calls

    def open_default_resource_manager(self) -> tuple[VISARMSession, StatusCode]:
        """Return a session of the resource manager."""
        session = VISARMSession(next(self._handles))
        self._last_status_in_session[session] = StatusCode.success
        return session, StatusCode.success

    def list_resources(self, session: VISARMSession, query: str = "?*::INSTR") -> tuple[str, ...]:
        """Return the resource names that match a VISA resource expression."""
        expression = re.compile(re.sub(r"(?<!\\)\?", ".", query), re.IGNORECASE)
        return tuple(name for name in self._devices if expression.fullmatch(name))

    def open(
        self,
        session: VISARMSession,
        resource_name: str,
        access_mode: constants.AccessModes = constants.AccessModes.no_lock,
        open_timeout: int = constants.VI_TMO_IMMEDIATE,
    ) -> tuple[VISASession, StatusCode]:
        """Open a session to a face. Raises VisaIOError for a name that is not there, or whose cable is out."""
        name = _canonical(resource_name)
        device = self._devices.get(name)
        if device is None or not device.connection.up:
            self.handle_return_value(None, StatusCode.error_resource_not_found)
            raise VisaIOError(StatusCode.error_resource_not_found)
        handle = VISASession(next(self._handles))
        self._sessions[handle] = _Session(
            device, device.connection, device.connection.pulled, _initial_attributes(name)
        )
        self._last_status_in_session[handle] = StatusCode.success
        return handle, StatusCode.success

    def close(self, session: VISASession | VISAEventContext | VISARMSession) -> StatusCode:
        """Close a session."""
        self._sessions.pop(session, None)
        self._last_status_in_session.pop(session, None)
        return StatusCode.success

    def write(self, session: VISASession, data: bytes) -> tuple[int, StatusCode]:
        """Send bytes to the face."""
        entry = self._connected(session)
        entry.device.write(data, entry.end)
        self._last_status_in_session[session] = StatusCode.success
        return len(data), StatusCode.success

    def read(self, session: VISASession, count: int) -> tuple[bytes, StatusCode]:
        """Read up to `count` bytes. Raises VisaIOError when nothing comes within the time-out, which passes virtually."""
        entry = self._connected(session)
        try:
            data, reason = entry.device.read(count, entry.timeout, entry.termination)
        except NoReplyError:
            self.handle_return_value(session, StatusCode.error_timeout)
            raise VisaIOError(StatusCode.error_timeout) from None
        status = StatusCode.success if reason is ReadEnd.MESSAGE else _STATUS[reason]
        self._last_status_in_session[session] = status
        return data, status

    def read_stb(self, session: VISASession) -> tuple[int, StatusCode]:
        """Return the status byte, as a serial poll would."""
        return self._connected(session).device.status_byte(), StatusCode.success

    def assert_trigger(self, session: VISASession, protocol: constants.TriggerProtocol) -> StatusCode:
        """Trigger the face."""
        self._connected(session).device.bus_trigger()
        return StatusCode.success

    def clear(self, session: VISASession) -> StatusCode:
        """Device clear."""
        self._connected(session).device.clear()
        return StatusCode.success

    def flush(self, session: VISASession, mask: constants.BufferOperation) -> StatusCode:
        """Nothing is buffered on this side, so there is nothing to flush."""
        self._session(session)
        return StatusCode.success

    def get_attribute(self, session: Any, attribute: Any) -> tuple[Any, StatusCode]:
        """Return an attribute of a session. Raises VisaIOError for one that is not supported."""
        attributes = self._session(session).attributes
        try:
            return attributes[int(attribute)], StatusCode.success
        except KeyError:
            raise VisaIOError(StatusCode.error_nonsupported_attribute) from None

    def set_attribute(self, session: VISASession, attribute: ResourceAttribute, attribute_state: Any) -> StatusCode:
        """Set an attribute of a session. Raises VisaIOError for one that is not supported or read-only."""
        entry = self._session(session)
        if int(attribute) not in entry.attributes:
            raise VisaIOError(StatusCode.error_nonsupported_attribute)
        if int(attribute) not in _WRITABLE:
            raise VisaIOError(StatusCode.error_attribute_read_only)
        entry.attributes[int(attribute)] = attribute_state
        milliseconds = entry.attributes[ResourceAttribute.timeout_value]
        entry.timeout = None if milliseconds == constants.VI_TMO_INFINITE else milliseconds / 1000.0
        enabled = entry.attributes[ResourceAttribute.termchar_enabled]
        entry.termination = int(entry.attributes[ResourceAttribute.termchar]) if enabled else None
        entry.end = bool(entry.attributes[ResourceAttribute.send_end_enabled])
        return StatusCode.success

    def disable_event(self, session: Any, event_type: Any, mechanism: Any) -> StatusCode:
        """There are no events to disable."""
        return StatusCode.success

    def discard_events(self, session: Any, event_type: Any, mechanism: Any) -> StatusCode:
        """There are no events to discard."""
        return StatusCode.success

    def enable_event(self, session: Any, event_type: Any, mechanism: Any, context: Any = None) -> StatusCode:
        """Raise VisaIOError: events are not supported."""
        raise VisaIOError(StatusCode.error_nonsupported_operation)

    def lock(
        self,
        session: VISASession,
        lock_type: constants.Lock,
        timeout: int,
        requested_key: str | None = None,
    ) -> tuple[str, StatusCode]:
        """Grant every lock: a bench in process has one client."""
        self._session(session)
        return requested_key or "", StatusCode.success

    def unlock(self, session: VISASession) -> StatusCode:
        """Give a lock back."""
        self._session(session)
        return StatusCode.success


_WRITABLE = {
    ResourceAttribute.timeout_value,
    ResourceAttribute.termchar,
    ResourceAttribute.termchar_enabled,
    ResourceAttribute.send_end_enabled,
    ResourceAttribute.suppress_end_enabled,
    ResourceAttribute.io_prot,
}


def _canonical(name: str) -> str:
    try:
        return str(rname.ResourceName.from_string(name))
    except rname.InvalidResourceName:
        raise VisaIOError(StatusCode.error_invalid_resource_name) from None


def _initial_attributes(name: str) -> dict[int, Any]:
    parsed = rname.ResourceName.from_string(name)
    board = getattr(parsed, "board", "0")
    return {
        ResourceAttribute.timeout_value: _DEFAULT_TIMEOUT,
        ResourceAttribute.termchar: ord("\n"),
        ResourceAttribute.termchar_enabled: constants.VI_FALSE,
        ResourceAttribute.send_end_enabled: constants.VI_TRUE,
        ResourceAttribute.suppress_end_enabled: constants.VI_FALSE,
        ResourceAttribute.io_prot: constants.IOProtocol.normal,
        ResourceAttribute.interface_type: parsed.interface_type_const,
        ResourceAttribute.interface_number: int(board) if str(board).isdigit() else 0,
        ResourceAttribute.resource_class: parsed.resource_class,
        ResourceAttribute.resource_name: name,
        ResourceAttribute.resource_manufacturer_name: "motorbench",
        ResourceAttribute.resource_impl_version: 0x00100000,
        ResourceAttribute.resource_spec_version: 0x00500800,
        ResourceAttribute.resource_lock_state: constants.AccessModes.no_lock,
        ResourceAttribute.tcpip_address: getattr(parsed, "host_address", ""),
        ResourceAttribute.tcpip_hostname: getattr(parsed, "host_address", ""),
        ResourceAttribute.tcpip_device_name: getattr(parsed, "lan_device_name", ""),
        ResourceAttribute.tcpip_is_hislip: constants.VI_FALSE,
    }
