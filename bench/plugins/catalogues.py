"""All catalogues together: what this installation has, and what plug-in files beside a station or a plan add."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from functools import cache, partial
from importlib.metadata import EntryPoint, distributions
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from bench.i18n.language import add_title, add_translations_beside
from bench.plugins.catalogue import OURS, BrokenPlugin, Catalogue, Origin, PluginFile, UnloadedDeclaration
from bench.plugins.records import RecordOutput
from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.interfaces.text import Text, text
from drivers.safety_devices import InterlockDriver, RelayDriver
from procedures.catalogue import ORDER

if TYPE_CHECKING:
    from procedures.core.procedure import Procedure
    from reports.exports.target import Target
    from sim_instruments.catalogue import SimulatedInstrument

_PREFIX = "motorbench."


class _Named(Protocol):
    @property
    def name(self) -> str: ...


NamedT = TypeVar("NamedT", bound=_Named)
GROUPS = ("drivers", "watchdog_relays", "interlocks", "simulated_instruments", "procedures", "exports", "records")


@dataclass(frozen=True)
class Catalogues:
    """The catalogues, one a group, and the plug-in files among what they were made of."""

    entries: dict[str, tuple[UnloadedDeclaration, ...]]
    unusable: tuple[BrokenPlugin, ...] = ()
    files: tuple[PluginFile, ...] = ()
    drivers: Catalogue[tuple[Driver, ...]] = field(init=False)
    watchdog_relays: Catalogue[RelayDriver] = field(init=False)
    interlocks: Catalogue[InterlockDriver] = field(init=False)
    simulated_instruments: "Catalogue[SimulatedInstrument]" = field(init=False)
    procedures: "Catalogue[type[Procedure[Any]]]" = field(init=False)
    exports: "Catalogue[Target]" = field(init=False)
    records: Catalogue[RecordOutput] = field(init=False)

    def __post_init__(self) -> None:
        for group in GROUPS:
            clash = parameter_clash if group == "procedures" else None
            made: Catalogue[Any] = Catalogue(self.entries.get(group, ()), _ACCEPT[group], self.unusable, clash)
            object.__setattr__(self, group, made)

    def with_files(self, files: Sequence[PluginFile]) -> "Catalogues":
        """Return these and what plug-in files declare besides."""
        added = [file for file in files if file not in self.files]
        if not added:
            return self
        entries = {
            group: (*self.entries.get(group, ()), *(entry for file in added for entry in file.entries.get(group, ())))
            for group in GROUPS
        }
        unusable = [BrokenPlugin("", file.origin, file.error) for file in added if file.error is not None]
        return Catalogues(entries, (*self.unusable, *unusable), (*self.files, *added))

    def driver(self, name: str, role: Role) -> Driver | None:
        """Return the driver of a name for a role, None where there is none."""
        return next((driver for driver in self.drivers.get(name, ()) if driver.role is role), None)

    def drivers_for(self, role: Role) -> list[str]:
        """Return the names of the drivers that can fill a role; all are loaded for it."""
        return [name for name in self.drivers if self.driver(name, role) is not None]

    def broken(self, *, load: bool = True) -> tuple[BrokenPlugin, ...]:
        """Return what cannot be used: of everything, or without `load` as far as it is known by now."""
        found = [broken for group in GROUPS for broken in getattr(self, group).broken(load=load)]
        return (*self.unusable, *found)

    def about(self) -> list[dict[str, str]]:
        """Return what a record says of the plug-ins that take part: distributions with version, files with SHA-256."""
        found = {entry.origin: entry.origin.as_dict() for group in self.entries.values() for entry in group}
        return [told for origin, told in found.items() if origin.name != OURS]


@cache
def installed() -> Catalogues:
    """Return what the installed distributions declare in the entry-point groups `motorbench.*`, ours first."""
    found: dict[str, list[UnloadedDeclaration]] = {group: [] for group in GROUPS}
    seen: set[str] = set()
    for distribution in distributions():
        declared = distribution.read_text("entry_points.txt")
        if declared is None or _PREFIX not in declared:
            continue
        name = str(distribution.metadata["Name"])
        if name in seen:
            continue
        seen.add(name)
        origin = Origin(name, distribution.version)
        for point in distribution.entry_points:
            group = point.group.removeprefix(_PREFIX)
            if point.group.startswith(_PREFIX) and group in found:
                ours = name == OURS
                load = point.load if ours else partial(_load_with_translations, point)
                found[group].append(UnloadedDeclaration(point.name, origin, load, "" if ours else point.module))
    for entries in found.values():
        entries.sort(key=lambda entry: (entry.origin.name != OURS, entry.origin.name))
    places = {name: place for place, name in enumerate(ORDER)}
    found["procedures"].sort(key=lambda entry: places.get(entry.name, len(places)))
    return Catalogues({group: tuple(entries) for group, entries in found.items()})


def _load_with_translations(point: EntryPoint) -> object:
    """Return what another distribution's entry point names; its translations stand beside the module that declares it."""
    declared = point.load()
    if (file := getattr(sys.modules[point.module], "__file__", None)) is not None:
        add_translations_beside(Path(file))
    return declared


def accept_drivers(name: str, loaded: object) -> tuple[Driver, ...]:
    """Return the drivers of a name, one a role. Raises ValueError for anything else."""
    result = loaded if isinstance(loaded, tuple) else (loaded,)
    if not result or not all(isinstance(driver, Driver) for driver in result):
        raise _other(loaded, "drivers.catalogue.Driver, or a tuple of them")
    for driver in result:
        _check_name(name, driver.name)
    return result


def accept_relay(name: str, loaded: object) -> RelayDriver:
    """Return the driver of a relay with a watchdog. Raises ValueError for anything else."""
    return _named(name, loaded, RelayDriver)


def accept_interlock(name: str, loaded: object) -> InterlockDriver:
    """Return the driver of interlock contacts. Raises ValueError for anything else."""
    return _named(name, loaded, InterlockDriver)


def accept_simulated(name: str, loaded: object) -> "SimulatedInstrument":
    """Return a simulated instrument. Raises ValueError for anything else."""
    from sim_instruments.catalogue import SimulatedInstrument

    return _named(name, loaded, SimulatedInstrument)


def accept_procedure(name: str, loaded: object) -> "type[Procedure[Any]]":
    """Return a procedure's class. Raises ValueError for anything else, or a class that is not complete."""
    from procedures.core.procedure import Procedure

    if not isinstance(loaded, type) or not issubclass(loaded, Procedure):
        raise _other(loaded, "subclass of procedures.core.procedure.Procedure")
    missing = [key for key in ("name", "title", "section", "roles", "gives") if not hasattr(loaded, key)]
    missing += sorted(getattr(loaded, "__abstractmethods__", ()))
    if missing:
        raise ValueError(text("{name} does not define {missing}", name=loaded.__name__, missing=missing))
    _check_name(name, loaded.name)
    _check_sentences(loaded)
    add_title(name, loaded.title)
    return loaded


def _check_sentences(procedure: "type[Procedure[Any]]") -> None:
    """Raise ValueError for a step whose sentence cannot be made of the settings, or settings without a default."""
    from procedures.core.procedure import Procedure

    settings = procedure.settings_type()
    bare = [name for name, field in settings.model_fields.items() if field.is_required()]
    if bare:
        raise ValueError(text("{name} has no default: {settings}", name=settings.__name__, settings=bare))
    if procedure.step_values is not Procedure.step_values:
        # What it adds to the sentences is known when it runs.
        return
    values = {**settings().model_dump(), "rated_current": 1.0}
    for step in procedure.steps():
        try:
            step.words(values).render()
        except (KeyError, IndexError) as error:
            named = str(error.args[0]) if isinstance(error, KeyError) else ""
            raise ValueError(
                text(
                    "step {step} names {placeholder} in its sentence, which is no setting; there are {known}",
                    step=step.identifier,
                    placeholder=f"{{{named}}}",
                    known=list(values),
                )
            ) from None
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(
                text(
                    "step {step}: the sentence {sentence!r} cannot be made of the settings: {error}",
                    step=step.identifier,
                    sentence=step.template,
                    error=error,
                )
            ) from None


def parameter_clash(procedure: "type[Procedure[Any]]", other: "type[Procedure[Any]]") -> Text | None:
    """Return which parameter two procedures define differently and in what, None where there is none."""
    for name, mine in procedure.parameters.items():
        theirs = other.parameters.get(name)
        if theirs is None or theirs == mine:
            continue
        # The unit first: it is what makes a figure wrong.
        keys = ("unit", "convention", *(field.name for field in fields(mine)))
        key = next(key for key in keys if getattr(mine, key) != getattr(theirs, key))
        return text(
            "parameter {parameter} is defined with {key} {mine}, but with {theirs}",
            parameter=name,
            key=key,
            mine=f"{getattr(mine, key)}",
            theirs=f"{getattr(theirs, key)}",
        )
    return None


def accept_export(name: str, loaded: object) -> "Target":
    """Return an export's target. Raises ValueError for anything else."""
    from reports.exports.target import Target

    return _named(name, loaded, Target)


def accept_records(name: str, loaded: object) -> RecordOutput:
    """Return an output for records. Raises ValueError for anything else."""
    return _named(name, loaded, RecordOutput)


def _named(name: str, loaded: object, kind: type[NamedT]) -> NamedT:
    if not isinstance(loaded, kind):
        raise _other(loaded, f"{kind.__module__}.{kind.__name__}")
    _check_name(name, loaded.name)
    return loaded


def _check_name(name: str, declared: object) -> None:
    if name != declared:
        raise ValueError(text("it declares the name {declared!r}", declared=declared))


def _other(loaded: object, wanted: str) -> ValueError:
    kind = loaded.__name__ if isinstance(loaded, type) else type(loaded).__name__
    return ValueError(text("it is {kind}, but must be a {wanted}", kind=kind, wanted=wanted))


_ACCEPT: dict[str, Callable[[str, object], Any]] = {
    "drivers": accept_drivers,
    "watchdog_relays": accept_relay,
    "interlocks": accept_interlock,
    "simulated_instruments": accept_simulated,
    "procedures": accept_procedure,
    "exports": accept_export,
    "records": accept_records,
}
