"""The dependencies of a plan's procedures compared with its order before the first motor: required figures, and corrections."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from bench.eol.plan import Plan, PlannedCheck
from bench.i18n.errors import FileError
from bench.run.plan import Catalogue, Planned
from drivers.interfaces.text import Text, text
from procedures.core.nameplate import Nameplate
from procedures.known_parameters import givers


def with_wanted_before(plan: Plan, planned: Sequence[Planned], nameplate: Nameplate, known: Catalogue) -> Plan:
    """Return the plan with each procedure `after` those whose figures it wants and those that correct what it reads.

    So no order parts them. `planned` are its procedures in its order, `known` all that there are. Raises InputError naming procedure
    and figure where none before it gives it to every motor that it is measured of: it would end as an error at each.
    """
    checks = list[PlannedCheck]()
    for check, each in zip(plan.checks, planned, strict=True):
        after = dict.fromkeys(check.after)
        kind: type[Any] = each.procedure
        for parameter, setting in kind.wanted_before(each.settings, nameplate).items():
            giving = [
                earlier.name
                for earlier, other in zip(checks, planned, strict=False)
                if parameter in other.procedure.parameters and check.every % earlier.every == 0
            ]
            if not giving:
                raise FileError(
                    text(
                        "{source}: procedure {name}: it needs {parameter}; {hint}, or give settings.{setting}",
                        source=plan.source,
                        name=check.name,
                        parameter=parameter,
                        hint=_hint(plan, planned, check, parameter, known),
                        setting=setting,
                    )
                )
            after |= dict.fromkeys(giving)
        checks.append(replace(check, after=tuple(after)))
    return replace(plan, checks=_corrected_before(checks, planned))


def _corrected_before(checks: Sequence[PlannedCheck], planned: Sequence[Planned]) -> tuple[PlannedCheck, ...]:
    """Return the checks with each `after` those that correct an instrument that it reads, wherever these are listed."""
    after = {check.name: list(check.after) for check in checks}

    def rests_on(name: str) -> set[str]:
        return {name}.union(*(rests_on(before) for before in after[name]))

    for correcting in planned:
        for each in planned:
            name = each.name
            reads = correcting.procedure.corrects & each.procedure.roles
            # Of what it rests on itself nothing can wait for it.
            if reads and correcting.name not in after[name] and name not in rests_on(correcting.name):
                after[name].append(correcting.name)
    return tuple(replace(check, after=tuple(after[check.name])) for check in checks)


def late_corrections(plan: Plan, planned: Sequence[Planned]) -> Iterator[Text]:
    """Give what of a plan in its `listed` order corrects an instrument only after others have read it."""
    if plan.order != "listed":
        return
    places = {check.name: number for number, check in enumerate(plan.checks)}
    for each in planned:
        late = [
            check.name
            for check, other in zip(plan.checks, planned, strict=True)
            if each.name in check.after
            and each.procedure.corrects & other.procedure.roles
            and places[check.name] < places[each.name]
        ]
        if late:
            yield text(
                "{source}: {name} corrects an instrument for what is measured after it, and is listed after {names}, which read "
                "that instrument uncorrected; put it before them",
                source=plan.source,
                name=each.name,
                names=late,
            )


def _hint(plan: Plan, planned: Sequence[Planned], wanting: PlannedCheck, parameter: str, known: Catalogue) -> Text:
    """Say what of the plan to change so that a figure is there."""
    giving = [check for check, each in zip(plan.checks, planned, strict=True) if parameter in each.procedure.parameters]
    if not giving:
        names = " or ".join(givers(known).get(parameter, ()))
        return text("no procedure of the plan gives it: put {names} before this one", names=names)
    if plan.checks.index(giving[0]) > plan.checks.index(wanting):
        return text("{name} gives it too late: put it before this one", name=giving[0].name)
    return text(
        "{name} gives it with every = {every} only, and this one is measured with every = {own}: give both the same",
        name=giving[0].name,
        every=giving[0].every,
        own=wanting.every,
    )
