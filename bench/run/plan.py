"""The procedures of a run, each with its settings."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bench.files.toml_file import nearest, validate
from bench.files.typed_value import typed_value
from bench.i18n.errors import UsageError
from bench.plugins.catalogue import Catalogue as Plugins
from bench.station.station_file import Station
from drivers.interfaces.role import Role
from drivers.interfaces.text import Text, Translate, text
from procedures.catalogue import ORDER, WHOLE
from procedures.core.nameplate import Nameplate
from procedures.core.parameter_definition import ParameterTable
from procedures.core.procedure import Procedure, Settings
from procedures.known_parameters import known_parameters

if TYPE_CHECKING:
    from bench.virtual.true_values import MeasuredAt

Catalogue = Mapping[str, type[Procedure[Any]]]


@dataclass(frozen=True)
class Planned:
    """A procedure and the settings it is to run with."""

    name: str
    procedure: type[Procedure[Any]]
    settings: Settings


def parameters_of(plan: Iterable[Planned]) -> ParameterTable:
    """Return the table's parameters, and those that the plan's procedures define besides."""
    return known_parameters({each.name: each.procedure for each in plan})


def measured_at(plan: Iterable[Planned], nameplate: Nameplate, station: Station) -> "MeasuredAt":
    """Return at which q-axis currents (A, peak) a plan measures torque per ampere, and at which frequency (Hz) inductances."""
    from bench.virtual.true_values import MeasuredAt

    currents: list[float] = []
    frequency = 0.0
    for each in plan:
        if each.name == "torque-constant":
            currents = _torque_currents(each.settings, nameplate, station)
        if getattr(each.settings, "at_frequency", False):
            frequency = float(getattr(each.settings, "frequency", 0.0))
    return MeasuredAt(currents, frequency)


def _torque_currents(settings: Settings, nameplate: Nameplate, station: Station) -> list[float]:
    from procedures.note.torque_constant import TorqueConstantSettings, torque_currents

    inverter = station.entries.get(Role.INVERTER)
    if not isinstance(settings, TorqueConstantSettings) or not settings.measured:
        return []
    most = float(getattr(inverter.options, "maximum_current", math.inf)) if inverter else math.inf
    return [float(each) for each in torque_currents(settings, nameplate, most)]


def titles_of(plan: Iterable[Planned], translate: Translate) -> Mapping[str, str]:
    """Return what the plan's procedures are called in a reader's language, by their names, in the plan's order."""
    return {each.name: translate(each.procedure.title) for each in plan}


def make_plan(names: Sequence[str], assignments: Sequence[str], catalogue: Catalogue) -> list[Planned]:
    """Return the procedures named (for `all`, a whole measurement's) with settings from `name=value` or
    `procedure.name=value`.

    Without a procedure's name a setting goes to every planned procedure that knows it. Raises UsageError for an unknown
    procedure or setting, InputError for a value that is not allowed.
    """
    if "all" in names and len(names) > 1:
        raise UsageError(text("all stands alone: name the other procedures in a run of their own, or each one"))
    wanted = whole(catalogue) if list(names) == ["all"] else list(dict.fromkeys(names))
    for name in wanted:
        if name not in catalogue:
            raise UsageError(
                text(
                    "{name!r} is neither a procedure nor all: {hint}",
                    name=name,
                    hint=_why_not(name, catalogue),
                )
            )
    manual = next((name for name in wanted if catalogue[name].manual), None)
    if manual is not None and len(wanted) > 1:
        raise UsageError(text("{name} must be the only procedure of a run", name=manual))
    given: dict[str, dict[str, Any]] = {name: {} for name in wanted}
    for assignment in assignments:
        _assign(assignment, given, catalogue)
    return [
        Planned(
            name,
            catalogue[name],
            validate(catalogue[name].settings_type(), given[name], "--set", name),
        )
        for name in wanted
    ]


def whole(catalogue: Catalogue) -> list[str]:
    """Return the procedures of a whole measurement, in order; what of ours is known to be none of it is not loaded."""
    names = catalogue.names if isinstance(catalogue, Plugins) else tuple(catalogue)
    others = set(ORDER) - set(WHOLE)
    return [name for name in names if name not in others and name in catalogue and catalogue[name].in_all()]


def roles_of(plan: Iterable[Planned], station: Station) -> set[Role]:
    """Return the roles that a plan may use at a station."""
    present = station.entries.keys()
    return {role for planned in plan for role in planned.procedure.roles_at(planned.settings, present)}


def _why_not(name: str, catalogue: Catalogue) -> Text:
    """Say why a procedure cannot be had; a catalogue of plug-ins knows which of them is broken."""
    return catalogue.why_not(name) if isinstance(catalogue, Plugins) else nearest(name, list(catalogue))


def _assign(assignment: str, given: dict[str, dict[str, Any]], catalogue: Catalogue) -> None:
    key, equals, typed = assignment.partition("=")
    owner, dot, setting = key.strip().rpartition(".")
    if not equals or not setting:
        raise UsageError(text("--set {assignment}: give name=value or procedure.name=value", assignment=assignment))
    if dot and owner not in given:
        raise UsageError(
            text(
                "--set {assignment}: {owner} is not a procedure of this run; its procedures are: {names}",
                assignment=assignment,
                owner=owner,
                names=list(given),
            )
        )
    owners = [name for name in ([owner] if dot else given) if setting in _settings(catalogue[name])]
    if not owners:
        known = sorted({known for name in ([owner] if dot else given) for known in _settings(catalogue[name])})
        hint = nearest(setting, known) if known else text("these procedures have no settings")
        raise UsageError(
            text("--set {assignment}: no setting {setting}; {hint}", assignment=assignment, setting=setting, hint=hint)
        )
    for name in owners:
        given[name][setting] = typed_value(typed.strip())


def _settings(procedure: type[Procedure[Any]]) -> list[str]:
    return list(procedure.settings_type().model_fields)
