"""The figures that a plan's procedures require of earlier ones, compared with its order before the first motor."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from bench.eol.line.preparation.declared_order import in_declared_order
from bench.eol.plan import Plan, PlannedCheck
from bench.i18n.errors import FileError
from bench.run.plan import Catalogue, Planned
from drivers.interfaces.text import Text, text
from procedures.core.nameplate import Nameplate
from procedures.known_parameters import givers


def with_wanted_before(plan: Plan, planned: Sequence[Planned], nameplate: Nameplate, known: Catalogue) -> Plan:
    """Return the plan with each procedure `after` those whose figures it wants and those that come first by what they declare.

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
    return replace(plan, checks=in_declared_order(checks, planned))


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
