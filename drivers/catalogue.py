"""Declaration of a driver, and the context in which it is opened; importing this imports no transport library.

Drivers are found by the entry-point group `motorbench.drivers`; an entry names a `Driver`, or a tuple of them, one a role.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, cast, get_type_hints

from drivers.interfaces import UNWATCHED, Calls, Clock, Instrument, InstrumentError, InverterAbility, Role, Traffic
from drivers.interfaces.text import Text, text
from drivers.manual.prompt import Prompt
from drivers.recognition import Recognition
from drivers.transport.can.buses import CanBuses
from drivers.transport.in_process import InProcess
from drivers.transport.wire import Wire

if TYPE_CHECKING:
    from pyvisa import ResourceManager

    from drivers.framing import FramingSetter

MANUAL = "manual"
#: What an instrument allows at most, by the names of ratings and of the options that may lower them, with its unit.
RATING_UNITS: Mapping[str, str] = {
    "maximum_voltage": "V",
    "maximum_current": "A",
    "maximum_frequency": "Hz",
    "maximum_speed": "rad/s",
    "maximum_torque": "N·m",
    "maximum_level": "V rms",
}
#: How long (s) an energised instrument may take to answer unless its driver or the station says otherwise.
REPLY_TIME = 0.6


@dataclass(frozen=True)
class Surroundings:
    """Context in which drivers are opened: the bench's clock, and for those that need it a VISA manager or a way to the person.

    `visa` is called when the first VISA instrument is opened, so that a bench without one needs no VISA. `calls` watches over each
    exchange. Instruments on one CAN bus that are handed the same `can_buses` share the connection to it. `in_process` opens
    the addresses of instruments that this process itself plays. With `guarding`, a second process holds the connection for
    the shutdown only: nothing that the first one could notice is asked when it is opened. `wire` receives every byte both ways.
    """

    clock: Clock
    visa: "Callable[[], ResourceManager] | None" = None
    prompt: Prompt | None = None
    traffic: Traffic | None = None
    calls: Calls = UNWATCHED
    can_buses: CanBuses = field(default_factory=CanBuses)
    in_process: InProcess | None = None
    guarding: bool = False
    wire: Wire | None = None

    def manager(self) -> "ResourceManager":
        """Return the VISA manager; raises ValueError where none was handed in."""
        if self.visa is None:
            raise ValueError("a VISA instrument needs a VISA resource manager")
        manager = self.visa()
        if self.wire is None:
            return manager
        from drivers.transport.visa.tapped import TappedManager

        return cast("ResourceManager", TappedManager(manager, self.wire))

    def person(self) -> Prompt:
        """Return the way to the person; raises ValueError where none was handed in."""
        if self.prompt is None:
            raise ValueError("a manual instrument needs a person to ask")
        return self.prompt


#: Opens an instrument at an address, which one worked by hand has not, under a name that stands for it in messages.
Opener = Callable[[str, Any, Surroundings, str], Instrument]


@dataclass(frozen=True)
class Driver:
    """One driver in one role.

    `options` is the dataclass of what a station file may say of it. `opener` is called with address, options, surroundings and
    name; written as `module:object` its module is imported when an instrument is opened, not before. `reply_time` (s) is how
    long the instrument may take to answer while it is energised. `simulated` names the simulated instrument that stands for
    it in a rehearsal (group `motorbench.simulated_instruments`); without one, the role's generic instrument does, with
    `ratings`: the largest values that it takes, by the names of the options that may lower them (`maximum_voltage` …, SI units).
    `sources` says what the driver was written from; a fact counts as known where two say it that do not copy each other.
    `commands_in` is the package whose `sources.toml` says it command by command.
    `framing` makes what sets how the instrument is spoken to on a shared serial line (a `drivers.framing.FramingSetter`); it is named and
    called as an opener is. `recognised_by` is what the instrument says of itself, all of its Modbus units where it is made of several.
    `abilities` are what an inverter can do, None where only the opened one says it.
    """

    name: str
    role: Role
    options: type[Any]
    opener: str | Opener
    needs_address: bool = True
    reply_time: float = REPLY_TIME
    simulated: str = ""
    ratings: Mapping[str, float] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    commands_in: str = ""
    recognised_by: tuple[Recognition, ...] = ()
    framing: str | Callable[..., "FramingSetter"] = ""
    abilities: frozenset[InverterAbility] | None = None

    def unfit(self) -> Text | None:
        """Return why what the driver makes is none of its role's instruments, as far as its class shows without one; None where it is.

        The class is the opener itself, or what the opener says that it returns.
        """
        try:
            opener = resolve_name(self.opener) if isinstance(self.opener, str) else self.opener
            made = opener if isinstance(opener, type) else get_type_hints(opener).get("return")
        except Exception:  # noqa: BLE001  a stranger's module may raise anything; opening the instrument says what
            return None
        interface = self.role.interface
        if not isinstance(made, type) or made is interface or made is object:
            return None
        kinds = {"driver": self.name, "kind": made.__name__, "interface": interface.__name__}
        if interface not in made.__mro__:
            # An instrument of any role may be all that is said.
            return (
                None
                if made in interface.__mro__
                else text("what driver {driver} makes, {kind}, is no {interface}", **kinds)
            )
        missing = sorted(getattr(made, "__abstractmethods__", ()))
        if not missing:
            return None
        return text(
            "what driver {driver} makes, {kind}, is no {interface}: it has no {missing}", **kinds, missing=missing
        )

    def framing_at(self, address: str, options: object, surroundings: Surroundings, name: str) -> "FramingSetter":
        """Return what sets the instrument's framing at an address. Raises LookupError where the driver has nothing that does."""
        if not self.framing:
            raise LookupError(self.name)
        make = resolve_name(self.framing) if isinstance(self.framing, str) else self.framing
        return cast("FramingSetter", make(address, options, surroundings, name))

    def open(self, address: str, options: object, surroundings: Surroundings, *, name: str = "") -> Instrument:
        """Open the instrument at an address; `name` stands for it in messages, its role when empty.

        Raises TypeError for options of another driver, InstrumentError where what is opened is not of the role's interface, and
        what the driver's own opener raises.
        """
        if not isinstance(options, self.options):
            raise TypeError(f"{self.name} takes {self.options.__name__}, not {type(options).__name__}")
        opener: Opener = resolve_name(self.opener) if isinstance(self.opener, str) else self.opener
        name, interface = name or self.role.value, self.role.interface
        remedy = text("Derive its class from {interface}", interface=f"{interface.__module__}.{interface.__name__}")
        try:
            instrument = opener(address, options, surroundings, name)
        except TypeError as error:
            raise InstrumentError(name, text("driver {driver}: {error}", driver=self.name, error=error)) from error
        if interface not in type(instrument).__mro__:
            kinds = {"driver": self.name, "kind": type(instrument).__name__, "interface": interface.__name__}
            raise InstrumentError(
                name, text("what driver {driver} makes, {kind}, is no {interface}", **kinds), remedy=remedy
            )
        return instrument
