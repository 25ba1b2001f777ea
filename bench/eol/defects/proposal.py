"""Limits and an order that a check proposes, and the plan with them."""

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tomli_w import dumps as toml_text

from bench.eol.defects.cases import DefectCase
from bench.eol.defects.findings import restated, sound_values
from bench.eol.defects.function_cost import INSULATION, DefectSeverity
from bench.eol.defects.trial import MotorTrial
from bench.eol.defects.verdicts import PlanRules
from bench.eol.limits import GuardBand, ParameterLimits, least_ratio
from bench.eol.line.preparation.procedure_order import by_time_over_failures
from bench.eol.plan import Plan, load_plan
from bench.files.new_file import write_new
from bench.files.toml_file import parse
from bench.i18n.errors import InputError
from drivers.interfaces.text import text
from procedures.core.parameter_definition import Bounds
from procedures.known_parameters import known_parameters

#: Share of the sound motors that one limit may reject: of ten limits together, a fifth of a per cent.
REJECTS = 2.0e-4
#: How sure that share is, for a spread that is known from so many motors only.
_CONFIDENCE = 0.95
#: With fewer sound motors no spread is known.
LEAST_SOUND = 20
#: Figures of which less is as good or better.
_ONLY_HIGH = frozenset(
    {"no_load_current", "no_load_bus_current", "coulomb_friction", "viscous_friction", "cogging_torque"}
)
_DEVIATIONS = ("%", "°")


@dataclass(frozen=True)
class Proposal:
    """Limits by parameter, and the procedures in order; `idle` are those that no gross or marginal defect is found by alone."""

    limits: Mapping[str, ParameterLimits]
    order: tuple[str, ...]
    idle: tuple[str, ...]


def propose(trials: Sequence[MotorTrial], cases: Sequence[DefectCase], rules: PlanRules) -> Proposal:
    """Return the fewest limits from the spread of sound motors that find as much as all of them do together.

    Raises InputError where too few sound motors were measured.
    """
    trials = [trial for trial in trials if trial.felt]
    sound = [trial for trial in trials if trial.case < 0]
    if len(sound) < LEAST_SOUND:
        raise InputError(
            text(
                "limits need the spread of {least} sound motors, there are {count}; raise --sound",
                least=LEAST_SOUND,
                count=len(sound),
            )
        )
    matters = [t for t in trials if t.case >= 0 and cases[t.case].cost.grade is not DefectSeverity.SLIGHT]
    names = dict.fromkeys(name for trial in sound for done in trial.procedures.values() for name in done.readings)
    every = {
        name: limits
        for name in names
        if not restated(name, names) and (limits := _limits(sound, name, rules)) is not None
    }
    # What only some motors were measured for keeps the limits that it has.
    few = {name: limits for name, limits in rules.limits.items() if len(sound_values(sound, name)) < LEAST_SOUND}
    every |= few
    everybody = replace(rules, limits=every)
    caught = [everybody.catches(trial) for trial in matters]
    kept = _fewest([{catch.parameter for catch in some} for some in caught], every)
    chosen = {name: limits for name, limits in every.items() if name in kept or name in few}
    chosen_rules = replace(rules, limits=chosen)
    by_procedure = [{catch.procedure for catch in chosen_rules.catches(trial)} for trial in matters]
    experience = _experience([check.name for check in rules.checks], sound, matters, by_procedure)
    idle = tuple(check.name for check in rules.checks if not any(some == {check.name} for some in by_procedure))
    return Proposal(chosen, tuple(check.name for check in by_time_over_failures(rules.checks, experience)), idle)


def _experience(
    names: Sequence[str], sound: Sequence[MotorTrial], matters: Sequence[MotorTrial], caught_by: Sequence[set[str]]
) -> dict[str, tuple[int, int, float]]:
    """Return of each procedure in how many motors that matter it was tried, how many it found, and its mean time (s).

    One of every n-th motor may have been tried in none that is sound. What was tried in none at all is taken to find nothing, and to
    be as slow as the slowest.
    """
    found, times = {}, {}
    for name in names:
        tried = [catches for trial, catches in zip(matters, caught_by, strict=True) if name in trial.procedures]
        found[name] = len(tried) or len(matters), sum(name in catches for catches in tried)
        durations = [[t.procedures[name].duration for t in some if name in t.procedures] for some in (sound, matters)]
        if of_one := durations[0] or durations[1]:
            times[name] = max(1e-3, math.fsum(of_one) / len(of_one))
    slowest = max(times.values(), default=1.0)
    return {name: (*found[name], times.get(name, slowest)) for name in names}


def _fewest(caught: Sequence[set[str]], every: Mapping[str, ParameterLimits]) -> set[str]:
    """Return a small set of parameters that rejects whoever all of them reject, the most useful first."""
    kept = set[str]()
    # What a procedure refuses needs no limit.
    left = [some for some in caught if some and some <= every.keys()]
    while left:
        best = max(every, key=lambda name: sum(name in some for some in left))
        kept.add(best)
        left = [some for some in left if best not in some]
    return kept


def _limits(sound: Sequence[MotorTrial], name: str, rules: PlanRules) -> ParameterLimits | None:
    readings = [r for t in sound for done in t.procedures.values() for n, r in done.readings.items() if n == name]
    values = sound_values(sound, name)
    if len(values) < LEAST_SOUND or not all(math.isfinite(value) for value in values):
        return None
    if name == "insulation_resistance":
        return ParameterLimits(low=INSULATION[0])
    mean = sum(values) / len(values)
    spread = math.sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))
    expanded = max(reading.expanded for reading in readings)
    if spread == 0.0:
        return ParameterLimits(mean, mean) if not expanded else None
    unit = readings[0].unit
    deviation = unit in _DEVIATIONS and min(values) >= 0.0
    reach = _factor(len(values)) * spread
    if deviation and mean < 2.5 * spread:
        # The largest of several deviations is about as Rayleigh's distribution: exp(−x²/rms²) lie beyond x.
        rms = math.sqrt(sum(value**2 for value in values) / len(values))
        reach = rms * math.sqrt(-math.log(REJECTS)) * _factor(len(values)) / _normal() - mean
    guard = {GuardBand.STRICT: expanded, GuardBand.SHARED: 0.0, GuardBand.LENIENT: -expanded}[rules.guard]
    reach = max(reach + guard, 0.0)
    if deviation or name in _ONLY_HIGH:
        # From nothing at all up to the limit it takes the whole interval, or the limit decides nothing.
        least = least_ratio(rules.guard, rules.minimum_ratio, ParameterLimits(high=mean))
        high = max(mean + reach, 2.0 * least * expanded * (1.0 + 1e-3))
        return ParameterLimits(high=_rounded(high, math.ceil))
    reach = max(reach, rules.minimum_ratio * expanded * (1.0 + 1e-3))
    return ParameterLimits(_rounded(mean - reach, math.floor), _rounded(mean + reach, math.ceil))


def _normal() -> float:
    from scipy.special import ndtri

    return float(-ndtri(0.5 * REJECTS))


def _factor(count: int) -> float:
    """Return a tolerance interval's factor: the normal quantile, times what a deviation from so many values may lack (Howe 1969)."""
    from scipy.special import gammaincinv

    least = 2.0 * float(gammaincinv(0.5 * (count - 1), 1.0 - _CONFIDENCE))
    return _normal() * math.sqrt((count - 1) * (1.0 + 1.0 / count) / least)


def _rounded(value: float, way: Any) -> float:
    """Return a limit to four digits, outwards."""
    if value == 0.0:
        return 0.0
    digits = 3 - math.floor(math.log10(abs(value)))
    scale = 10.0**digits
    return float(f"{way(value * scale) / scale:.4g}")


def write_plan(proposal: Proposal, plan: Plan, path: Path, about: str) -> Plan:
    """Write a plan with the proposed limits and order, and the rest as it was; return it as it is read.

    Raises InputError where the file is there already or cannot be written.
    """
    data = parse(plan.content.encode(), plan.source)
    if os.path.isfile(plan.motor):
        beside = os.path.relpath(plan.motor, path.parent or Path())
        data["plan"]["motor"] = beside if re.match(r"[\w.]", beside) else plan.motor
    # The order is the file's from now on.
    data["plan"]["order"] = "listed"
    procedures = {procedure["name"]: procedure for procedure in data["procedure"]}
    data["procedure"] = [procedures[name] for name in proposal.order]
    found = plan.catalogues().procedures
    known = known_parameters({name: found[name] for name in proposal.order})
    sides = {name: _sides(limits, known[name].bounds) for name, limits in proposal.limits.items()}
    data["limit"] = [{"parameter": name, **each} for name, each in sides.items() if each]
    data.pop("golden", None)
    write_new(path, f"# {about}\n" + toml_text(data))
    return load_plan(path)


def _sides(limits: ParameterLimits, bounds: Bounds) -> dict[str, float]:
    """Return the sides as a plan has them; one beyond which no figure can lie says nothing, and is left out."""
    sides = {"low": limits.low} if limits.low >= bounds.low else {}
    if bounds.high is None or limits.high <= bounds.high:
        sides["high"] = limits.high
    return {side: value for side, value in sides.items() if math.isfinite(value)}
