"""Compares a plan's requirements with the station file: reasons to refuse a run, and manual work."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

from bench.i18n.errors import FileError
from bench.run.plan import Planned, make_plan
from bench.run.probe_limits import unstated_probes
from bench.station.station_file import VIRTUAL, Entry, Station
from drivers.catalogue import MANUAL
from drivers.interfaces import InverterAbility, Role
from drivers.interfaces.text import Text, Translate, lines, text
from procedures.core.demand import Demand, Measurand

if TYPE_CHECKING:
    from rich.console import Console

#: Drivers whose figures a person brings.
BY_HAND = frozenset({MANUAL, "capture-files"})


def possible(plan: Sequence[Planned], station: Station, console: "Console", translate: Translate) -> list[Planned]:
    """Return the procedures that the station has what is needed for, and say which are left out and why."""
    possible = []
    for planned in plan:
        missing = unmet(planned, station)
        if missing:
            title = Text(planned.procedure.title)
            left_out = text("{procedure} is left out: {why}", procedure=title, why=lines(missing, between="; "))
            console.print(left_out.render(translate), markup=False)
        else:
            possible.append(planned)
    return possible


def check_needs(plan: Sequence[Planned], station: Station) -> None:
    """Raise FileError where the station lacks what a procedure needs."""
    for planned in plan:
        missing = unmet(planned, station)
        if missing:
            why = lines([*missing, *_instead(planned, plan, station)], between="; ")
            raise FileError(text("{source}: {name}: {why}", source=station.source, name=planned.name, why=why))


def _instead(refused: Planned, plan: Sequence[Planned], station: Station) -> Iterator[Text]:
    """Say what else finds the same here where an instrument has not the ability that a procedure takes."""
    lacking = any(
        _not_offered(station.entries[role], demand)
        for role, demand in refused.procedure.needed(refused.settings).items()
        if role in station.entries
    )
    if not lacking:
        return
    known, gives = station.catalogues.procedures, set(refused.procedure.gives)
    same = [
        name
        for name, other in known.items()
        if name != refused.name and gives <= set(other.gives) and not (other.manual or other.end_of_line)
    ]
    planned = [each.name for each in plan]
    taken = [name for name in same if name in planned]
    if taken:
        yield text("leave it out, because {name} gives the same result in this run", name=taken[0])
        return
    able = [name for name in same if not unmet(make_plan([name], [], known)[0], station)]
    if able:
        command = " ".join(able[0] if name == refused.name else name for name in planned)
        yield text("{names} give the same result here, e.g. motorbench run {command}", names=able, command=command)
    if station.source == VIRTUAL and len(planned) > 1:
        yield text(
            "the virtual bench has only one inverter in a run, and another procedure needs the one that "
            "regulates d- and q-axis currents. Use a separate run: motorbench run {name}",
            name=refused.name,
        )


def unmet(planned: Planned, station: Station) -> list[Text]:
    """Return what the station lacks for a procedure, each with what to write into its file; nothing is opened."""
    entries, said = station.entries, []
    roles = planned.procedure.roles_at(planned.settings, entries.keys())
    absent = sorted(f"[instruments.{role.value}]" for role in roles - entries.keys())
    if absent == ["[instruments.drive]"] and station.source == VIRTUAL:
        said.append(
            text(
                "the virtual bench has a six-step drive only for a motor that runs on one, as with --motor 92bl-30-25l"
            )
        )
    elif absent:
        said.append(text("it needs {tables}", tables=absent))
    for role, demand in planned.procedure.needed(planned.settings).items():
        if role in entries:
            said += _lacking(entries[role], demand)
    return said


def asked(planned: Planned, station: Station) -> list[Text]:
    """Return what people are asked for in a procedure: hands, readings, a temperature, limits of probes."""
    entries, said = station.entries, []
    roles = planned.procedure.roles_at(planned.settings, entries.keys())
    if any(step.by_hand for step in planned.procedure.steps()):
        said.append(text("hands"))
    typed = [role.value for role in roles & entries.keys() if entries[role].driver.name in BY_HAND]
    if typed:
        said.append(text("readings of {roles}", roles=sorted(typed)))
    if getattr(planned.settings, "winding_temperature", 0.0) is None:
        said.append(text("the winding's temperature"))
    open_probes = unstated_probes(station)
    if Role.OSCILLOSCOPE in roles and open_probes:
        said.append(text("limits of the probes on channels {channels}", channels=sorted(open_probes)))
    return said


def _lacking(entry: Entry, demand: Demand) -> Iterator[Text]:
    role, by_hand = entry.role.value, entry.driver.name == MANUAL
    if demand.automatic and entry.driver.name in BY_HAND:
        yield text("{role}: needs more readings than a person can take", role=role)
        return
    if demand.waveforms and by_hand:
        yield text("{role}: a person reads no waveforms", role=role)
    elif by_hand:
        yield from _unstated(entry, (*demand.figures, *demand.screen))
    elif entry.driver.name in BY_HAND and (demand.waveforms or demand.screen):
        yield from _unstated(entry, (Measurand.AMPLITUDE,))
    for ability in sorted(_not_offered(entry, demand), key=lambda one: one.value):
        yield text(
            "{role}: {driver} does not offer {ability}", role=role, driver=entry.driver.name, ability=ability.label
        )
    probes = getattr(entry.options, "probes", None)
    if isinstance(probes, Mapping):
        kinds = [getattr(probe, "kind", probe) for probe in probes.values()]
        for kind, count in demand.probes.items():
            if kinds.count(kind) < count:
                yield text(
                    "{role}: {count} probes of kind {kind} are needed, the file names {found} ({role}.probes)",
                    role=role,
                    count=count,
                    kind=kind.value,
                    found=kinds.count(kind),
                )


def _not_offered(entry: Entry, demand: Demand) -> frozenset[InverterAbility]:
    offered = entry.driver.abilities
    return frozenset() if offered is None else demand.abilities - offered


def _unstated(entry: Entry, figures: tuple[Measurand, ...]) -> Iterator[Text]:
    """Say which accuracies are not stated of an instrument that a person reads."""
    options = entry.options
    known = {option.name for option in fields(options)}  # type: ignore[arg-type]
    for figure in figures:
        if figure is Measurand.INDUCTANCE and getattr(options, "direct_current", False):
            yield text("{role} measures with direct current, and no inductance", role=entry.role.value)
            continue
        name = f"{figure.value}_accuracy" if f"{figure.value}_accuracy" in known else "accuracy"
        if not getattr(options, name):
            yield text("{role}: {name} is not stated", role=entry.role.value, name=name)
