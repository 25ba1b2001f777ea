"""What procedures declare of their order: safety tests before what energises, corrections before what reads."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from bench.eol.plan import Plan, PlannedCheck
from bench.run.plan import Planned
from drivers.interfaces.text import Text, text


def in_declared_order(checks: Sequence[PlannedCheck], planned: Sequence[Planned]) -> tuple[PlannedCheck, ...]:
    """Return the checks with each `after` the safety tests that come before it and after what corrects an instrument that it reads.

    Wherever these are listed; but nothing waits for what itself comes after it by the plan's `after` or by the figures that it wants.
    """
    after = {check.name: list(check.after) for check in checks}
    for comes_before in (_safety_first, _corrects):
        for one in planned:
            for other in planned:
                if (
                    comes_before(one, other)
                    and one.name not in after[other.name]
                    and other.name not in _resting_on(one.name, after)
                ):
                    after[other.name].append(one.name)
    return tuple(replace(check, after=tuple(after[check.name])) for check in checks)


def order_notes(plan: Plan, planned: Sequence[Planned]) -> Iterator[Text]:
    """Give what of a plan in its `listed` order comes too late by what the procedures declare, and what no failure would stop.

    `plan` has its checks as `in_declared_order` returns them.
    """
    for name, late in _late(plan, planned, _safety_first):
        yield text(
            "{source}: {name} is a safety test and is listed after {names}, which energise the motor before it is known to be "
            "safe; put it before them, or name in its after what it must wait for",
            source=plan.source,
            name=name,
            names=late,
        )
    for name, late in _late(plan, planned, _corrects):
        yield text(
            "{source}: {name} corrects an instrument for what is measured after it, and is listed after {names}, which read "
            "that instrument uncorrected; put it before them",
            source=plan.source,
            name=name,
            names=late,
        )
    going_on = {check.name for check in plan.checks if check.on_failure == "go_on"}
    names = [each.name for each in planned if each.procedure.safety_test is not None and each.name in going_on]
    if names and any(_energises(each) for each in planned if each.procedure.safety_test is None):
        yield text(
            "{source}: a motor that fails a safety test is energised all the same: on_failure is go_on for {names}; give it "
            "on_failure = 'stop'",
            source=plan.source,
            names=names,
        )


def safety_tests(planned: Sequence[Planned]) -> tuple[str, ...]:
    """Return the names of the safety tests that other procedures wait for, in the order in which they come."""
    tests = [each for each in planned if any(_safety_first(each, other) for other in planned)]
    return tuple(each.name for each in sorted(tests, key=lambda each: each.procedure.safety_test or 0))


def _safety_first(one: Planned, other: Planned) -> bool:
    """Tell whether one is a safety test that comes before the other: a later one, or what feeds the motor or turns its shaft."""
    stage, others = one.procedure.safety_test, other.procedure.safety_test
    if stage is None:
        return False
    return stage < others if others is not None else _energises(other)


def _corrects(one: Planned, other: Planned) -> bool:
    return one is not other and bool(one.procedure.corrects & other.procedure.roles)


def _energises(each: Planned) -> bool:
    return any(role.feeds for role in each.procedure.roles)


def _resting_on(name: str, after: dict[str, list[str]]) -> set[str]:
    """Return a procedure with all that come before it, through whatever others."""
    found, waiting = set[str](), [name]
    while waiting:
        if (one := waiting.pop()) not in found:
            found.add(one)
            waiting += after.get(one, ())
    return found


def _late(
    plan: Plan, planned: Sequence[Planned], comes_before: Callable[[Planned, Planned], bool]
) -> Iterator[tuple[str, list[str]]]:
    """Give what is listed after others that wait for it, with these."""
    if plan.order != "listed":
        return
    places = {check.name: number for number, check in enumerate(plan.checks)}
    for each in planned:
        late = [
            check.name
            for check, other in zip(plan.checks, planned, strict=True)
            if each.name in check.after and comes_before(each, other) and places[check.name] < places[each.name]
        ]
        if late:
            yield each.name, late
