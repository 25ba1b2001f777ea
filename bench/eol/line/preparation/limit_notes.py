"""Limits that no motor can keep, or that say nothing: refused or said before the first motor."""

import math
from collections.abc import Iterator, Mapping
from itertools import combinations

from bench.eol.limits import ParameterLimits, judge, least_ratio
from bench.eol.plan import Plan
from bench.eol.verdict import Verdict
from bench.i18n.errors import FileError
from bench.run.plan import Catalogue
from drivers.interfaces.text import Text, text
from procedures.core.parameter_definition import ParameterDefinition

#: Parameters that are whole numbers.
COUNTS = frozenset({"pole_pairs", "phase_order", "hall_faults"})
#: What is measured of the station, for the figures after it.
_OF_STATION = frozenset(f"channel_{number}_gain" for number in range(1, 9))
#: Parameters that are the flux linkage times a factor and a power of the pole pairs.
_PER_FLUX: Mapping[str, tuple[float, int]] = {
    "flux_linkage": (1.0, 0),
    "back_emf_constant_mechanical": (1.0, 1),
    "back_emf_constant_v_per_krpm": (1000.0 * math.pi / 30.0, 1),
    "back_emf_constant_v_per_rpm": (math.pi / 30.0, 1),
}


def check_limits(plan: Plan, limits: Mapping[str, ParameterLimits]) -> None:
    """Raise InputError for limits that no figure can keep: a count without a whole number, no room for a measured one."""
    for parameter, bounds in limits.items():
        where = {"source": plan.source, "parameter": parameter, "low": f"{bounds.low:g}", "high": f"{bounds.high:g}"}
        if parameter in COUNTS:
            if math.isfinite(bounds.tolerance) and math.ceil(bounds.low) > math.floor(bounds.high):
                raise FileError(
                    text(
                        "{source}: limit on {parameter}: it is a count, and no whole number lies within {low} … {high}",
                        **where
                    )
                )  # fmt: skip
        elif bounds.tolerance == 0.0:
            raise FileError(
                text(
                    "{source}: limit on {parameter}: low and high are both {low}, which leaves nothing for the figure's uncertainty; "
                    "give them apart by a few times that (motorbench eol check tells it)",
                    **where,
                )
            )


def limit_notes(
    plan: Plan, limits: Mapping[str, ParameterLimits], expected: Mapping[str, float], known: Catalogue
) -> Iterator[Text]:
    """Give what of a plan's limits is likely a mistake: the type itself outside, limits of one quantity that exclude each other, and
    procedures of which nothing has a limit.
    """
    for parameter, bounds in limits.items():
        value = expected.get(parameter)
        if value is not None and not bounds.low <= value <= bounds.high:
            yield text(
                "{source}: limit on {parameter}: the type's own {value:g} (expected.{parameter} of {motor}) lies outside "
                "{limits}",
                source=plan.source,
                parameter=parameter,
                value=value,
                motor=plan.motor,
                limits=_range(bounds),
            )
    yield from _contradictions(plan, limits, expected)
    if not limits:
        yield text("{source}: there is no [[limit]]: every motor that can be measured passes", source=plan.source)
        return
    found = {check.name: known[check.name].parameters.keys() - _OF_STATION for check in plan.checks}
    idle = [name for name, figures in found.items() if figures and not figures & limits.keys()]
    if idle:
        yield text(
            "{source}: none of their figures has a limit, so that only what they refuse is rejected: {names}",
            source=plan.source,
            names=idle,
        )


def _contradictions(plan: Plan, limits: Mapping[str, ParameterLimits], expected: Mapping[str, float]) -> Iterator[Text]:
    """Give limits of the flux linkage in two forms that no motor of the type's pole pairs can keep both."""
    counted = limits.get("pole_pairs", ParameterLimits())
    pairs = counted.low if counted.tolerance == 0.0 else expected.get("pole_pairs")
    if not pairs:
        return
    as_flux = {
        name: ParameterLimits(limits[name].low / (factor * pairs**power), limits[name].high / (factor * pairs**power))
        for name, (factor, power) in _PER_FLUX.items()
        if name in limits
    }
    for (one, first), (other, second) in combinations(as_flux.items(), 2):
        if max(first.low, second.low) > min(first.high, second.high):
            yield text(
                "{source}: limits on {one} and {other} exclude each other, and no motor passes: with {pairs:g} pole pairs the one "
                "is a flux linkage of {first} V·s/rad, the other of {second}. EMF constants are peak phase values here; one of "
                "line to line, rms, is √1.5 times as large",
                source=plan.source,
                one=one,
                other=other,
                pairs=pairs,
                first=_range(first),
                second=_range(second),
            )


def _range(limits: ParameterLimits) -> str:
    low, high = (f"{side:.4g}" if math.isfinite(side) else "–" for side in (limits.low, limits.high))
    return f"{low} … {high}"


def undecidable(
    plan: Plan, limits: ParameterLimits, parameter: ParameterDefinition, expanded: float, expected: float | None
) -> Text | None:
    """Return why a station cannot decide limits, by the expanded uncertainty that a figure of its had; None where it can.

    An open side ends where no figure of the parameter can be. `expected` is the type's own value, where the motor file has one.
    """
    if not expanded > 0.0:
        return None
    least = least_ratio(plan.guard, plan.minimum_ratio, limits)
    room = limits.within(parameter.bounds)
    ratio = room.tolerance / (2.0 * expanded)
    told = {
        "source": plan.source,
        "parameter": parameter.name,
        "low": room.low,
        "high": room.high,
        "ratio": ratio,
        "least": least,
    }
    if ratio < least and math.isfinite(limits.tolerance):
        return text(
            "{source}: limit on {parameter}: {low:g} … {high:g} is {ratio:.2g} times the width of the 95 % interval that this "
            "station's latest figure had, and {least:g} are asked for: it will be an error",
            **told,
        )
    if ratio < least:
        return text(
            "{source}: limit on {parameter}: figures from {low:g} to {high:g} are accepted, {ratio:.2g} times the width of the 95 % "
            "interval that this station's latest figure had, and {least:g} are asked for: the limit decides nothing here",
            **told,
        )
    if expected is None or judge(expected, 0.0, limits, plan.guard).verdict is not Verdict.PASS:
        return None
    if judge(expected, expanded, limits, plan.guard).verdict is not Verdict.PASS:
        return text(
            "{source}: limit on {parameter}: the type's own {value:g} lies nearer to the limit than the ± {expanded:.2g} that this "
            "station's latest figure had: such a motor is rejected",
            source=plan.source,
            parameter=parameter.name,
            value=expected,
            expanded=expanded,
        )
    return None
