"""Consistency of all figures of a run, with each other and with the nameplate; if not consistent, the likely error."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from drivers.interfaces.text import Text, text
from procedures.core.nameplate import Nameplate
from procedures.core.parameter_definition import ParameterTable
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Notice, Parameter
from procedures.known_parameters import Procedures, known_parameters
from procedures.note.torque_constant import DERIVED
from procedures.plausibility import factor_errors
from procedures.plausibility.factor_errors import FactorError, Ratio, quotient
from procedures.plausibility.type_tolerance import held_against_type

Findings = Mapping[str, Mapping[str, Any]]
_Keyed = tuple[tuple[str, str], Notice]
_Pair = tuple[float, float]
_Ratios = list[tuple[Parameter, Ratio]]

#: Procedure whose findings hold the time constants, and those that read inductances with a bridge.
_STEP = "dq-inductance-time-constant"
_BRIDGES = ("dq-inductance-extremes", "dq-inductance-aligned")
#: Slack (of the logarithm) for what no budget holds: iron and magnets between two working points; a warm winding, leads, source.
_FLUX_SLACK, _IRON_SLACK, _COPPER_SLACK = 0.06, 0.12, 0.2
#: A time constant names a mistake within this: the copper's temperature is in it.
_COPPER_WINDOW = 0.15
#: Voltage that full torque at rated speed asks for, over the rated one: every healthy motor; and what a mistake must lead back to.
_PLATE_BOUNDS, _PLATE_USUAL, _PLATE_CENTRE = (0.3, 1.7), (0.45, 1.4), 0.8
#: The rated current's reactive drop at rated speed over the rated voltage, at most: field weakening needs more than one.
_MOST_REACTIVE = 5.0
#: A type value is no more than a guess: only a plain factor is a finding.
_TYPE_SLACK, _TYPE_WINDOW = 0.3, 0.12


def check_consistency(
    found: ParameterSet, findings: Findings, nameplate: Nameplate, procedures: Procedures | None = None
) -> tuple[Notice, ...]:
    """Return an alarm for every inconsistency that a known mistake explains; none for a motor whose figures agree.

    `findings` are those of the procedures by name; `procedures`, else the installed ones, define the parameters.
    One mistake raises one alarm: what follows from it is not told again.
    """
    # As measured, before flux linkage and pole pairs were held against it.
    torque = findings.get("torque-constant", {}).get("measured")
    measured = (torque["value"], torque["standard_uncertainty"]) if torque else _measured_torque_constant(found)
    pairs, alarms = _pole_pairs(found, nameplate, measured)
    alarms += _torque(found, pairs, measured) if pairs else []
    if pairs and not alarms:
        alarms += _plate(found, pairs, nameplate)
    alarms += _winding(found, pairs or 1.0, nameplate)
    alarms += _inductances(found, findings)
    # What a mistake explains already is not held against the type values besides.
    type_values = () if alarms else _type_values(found, nameplate, pairs or 1.0, known_parameters(procedures))
    return (*alarms, *type_values, *held_against_type(found, nameplate))


def _pole_pairs(found: ParameterSet, nameplate: Nameplate, torque: _Pair | None) -> tuple[float | None, list[Notice]]:
    """Return the pole pairs that most speaks for, and an alarm where anything else was claimed."""
    claims = {p.procedure: float(p.value) for p in _figures(found, "pole_pairs")}
    if nameplate.pole_pairs is not None:
        claims["nameplate"] = float(nameplate.pole_pairs)
    if "pole_pairs" in nameplate.expected:
        claims["expected"] = nameplate.expected["pole_pairs"]
    if not claims:
        return None, []
    # Where as many speak for one as for another, the one that the torque constant bears out; else what was measured first.
    counted = Counter(claims.values())
    best = min(counted, key=lambda p: (-counted[p], _torque_misfit(found, p, torque)))
    alarms = []
    for claimed in counted:
        if claimed == best:
            continue
        who = [name for name, value in claims.items() if value == claimed]
        words = {
            2.0: text("poles counted for pole pairs"),
            0.5: text("every other position or period missed, or pole pairs halved once more"),
        }.get(claimed / best, text("a position or period missed or counted twice, or a shaft that slips"))
        alarms.append(
            Notice(
                "consistency-pole-pairs",
                text(
                    "{who}: {claimed:g} pole pairs, but {others}: {best:g}. Likely: {mistake}",
                    who=who,
                    claimed=claimed,
                    others=[name for name, value in claims.items() if value == best],
                    best=best,
                    mistake=words,
                ),
            )
        )
    return best, alarms


def _winding(found: ParameterSet, pairs: float, nameplate: Nameplate) -> list[Notice]:
    """Hold what the rated current drops in the winding against the rated voltage: a prefix left out at every reading shows nowhere else."""
    rated = nameplate.rated_voltage
    if not rated:
        return []
    electrical = pairs * (nameplate.rated_speed_rpm or 0.0) * math.pi / 30.0
    alarms = []
    for name, per_ampere, most in (
        ("stator_resistance", 1.0, 1.0),
        ("d_axis_inductance", electrical, _MOST_REACTIVE),
        ("q_axis_inductance", electrical, _MOST_REACTIVE),
    ):
        figure = found.parameters.get(name)
        drop = per_ampere * figure.value * nameplate.rated_current if figure else 0.0
        if figure and drop > most * rated:
            alarms.append(
                Notice(
                    "consistency-winding",
                    text(
                        "{label}: the rated current would drop {drop:.3g} V in it, but the rated voltage is "
                        "{rated:g} V. Likely: readings typed without their prefix, mΩ as Ω or mH as H, or a wrong "
                        "rated current",
                        label=figure.label,
                        drop=drop,
                        rated=rated,
                    ),
                )
            )
    return alarms


def _torque_misfit(found: ParameterSet, pairs: float, torque: _Pair | None) -> float:
    ratio = _against_flux(found, torque, 1.5 * pairs)
    return abs(math.log(ratio.value)) if ratio else 0.0


def _torque(found: ParameterSet, pairs: float, measured: _Pair | None) -> list[Notice]:
    """Hold the measured torque constant and the EMF at mechanical speed against p·λ, and find which of the three is off."""
    torque = _against_flux(found, measured, 1.5 * pairs)
    constant = found.parameters.get("back_emf_constant_mechanical")
    emf = _against_flux(found, _pair(constant) if constant else None, pairs)
    torque_off = torque is not None and torque.deviates(_FLUX_SLACK)
    emf_off = emf is not None and emf.deviates(_FLUX_SLACK)
    if torque is not None and torque_off:
        if emf is None:
            candidates: Sequence[FactorError] = (*factor_errors.TORQUE, *factor_errors.of_flux(pairs))
        else:
            candidates = factor_errors.of_flux(pairs) if emf_off else factor_errors.TORQUE
        return _alarm(
            "consistency-torque-constant",
            torque.shows(candidates),
            text("the measured torque constant is {ratio:.3g} times 1.5·p·λ", ratio=torque.value),
        )
    if emf is not None and emf_off:
        candidates = (
            factor_errors.of_emf(pairs)
            if torque is not None
            else (*factor_errors.of_emf(pairs), *factor_errors.of_flux(pairs))
        )
        return _alarm(
            "consistency-emf",
            emf.shows(candidates),
            text("the EMF constant at mechanical speed is {ratio:.3g} times p·λ", ratio=emf.value),
        )
    return []


def _plate(found: ParameterSet, pairs: float, nameplate: Nameplate) -> list[Notice]:
    """Hold the voltage that full torque at rated speed asks for against the rated one: decidable for large factors only."""
    flux = found.parameters.get("flux_linkage")
    if flux is None or not nameplate.rated_voltage or not nameplate.rated_speed_rpm or flux.value <= 0.0:
        return []
    electrical = pairs * nameplate.rated_speed_rpm * math.pi / 30.0

    def share(factor: float) -> float:
        resistance, inductance = (_value(found, name) for name in ("stator_resistance", "q_axis_inductance"))
        drop, reactive = (x * nameplate.rated_current for x in (resistance, electrical * inductance))
        phase = math.hypot(electrical * flux.value / factor + drop, reactive)
        return math.sqrt(3.0) * phase / (nameplate.rated_voltage or 1.0)

    now = share(1.0)
    reach = math.exp(factor_errors.COVERAGE * flux.standard_uncertainty / flux.value)
    if _PLATE_BOUNDS[0] / reach <= now <= _PLATE_BOUNDS[1] * reach:
        return []
    fitting = [m for m in factor_errors.of_plate(pairs) if _PLATE_USUAL[0] <= share(m.factor) <= _PLATE_USUAL[1]]
    fitting.sort(key=lambda m: abs(math.log(share(m.factor) / _PLATE_CENTRE)))
    named = {m.words.template: m.words for m in fitting}
    return _alarm(
        "consistency-plate",
        tuple(named.values()),
        text(
            "by p·λ, full torque at the rated speed would need {share:.2g} times the rated voltage",
            share=now,
        ),
    )


def _inductances(found: ParameterSet, findings: Findings) -> list[Notice]:
    """Hold bridge, step and resistance against each other by the step's time constant, and find which of them is off."""
    alarms: dict[tuple[str, str], Notice] = {}
    for axis in ("d", "q"):
        for key, notice in _axis(found, findings, axis):
            # Both axes show the same mistake: said once.
            alarms.setdefault(key, notice)
    return list(alarms.values())


def _axis(found: ParameterSet, findings: Findings, axis: str) -> Iterator[_Keyed]:
    figures = {p.procedure: p for p in _figures(found, f"{axis}_axis_inductance")}
    step = figures.get(_STEP)
    bridges = [figures[name] for name in _BRIDGES if name in figures]
    if step is None:
        yield from _bridges_alone(bridges)
        return
    tau = findings.get(_STEP, {}).get(axis, {}).get("time_constant") or 0.0
    # 1 where L of the step, R and the time constant go together.
    loops = _ratios(
        (r, (r.value * tau, r.standard_uncertainty * tau), _pair(step)) for r in _figures(found, "stator_resistance")
    )
    against = _ratios((b, _pair(step), _pair(b)) for b in bridges)
    wrong_loops = [(r, ratio) for r, ratio in loops if ratio.deviates(_COPPER_SLACK)]
    wrong_bridges = [(b, ratio) for b, ratio in against if ratio.deviates(_IRON_SLACK)]
    if _step_is_off(loops, wrong_loops, against, wrong_bridges):
        ratio = against[0][1].inverse()
        yield from _inductance_alarm(step, ratio.shows(factor_errors.INDUCTANCE), ratio)
        return
    for bridge, ratio in wrong_bridges:
        named = ratio.shows(factor_errors.INDUCTANCE)
        if not loops and len(against) == 1:
            named += ratio.inverse().shows(factor_errors.INDUCTANCE)
        yield from _inductance_alarm(bridge, named, ratio)
    for resistance, loop in wrong_loops:
        ratio = loop.inverse()
        named = ratio.shows(factor_errors.RESISTANCE, _COPPER_WINDOW)
        if not bridges:
            named += loop.shows(factor_errors.INDUCTANCE, _COPPER_WINDOW)
        message = text(
            "{procedure}: the resistance is {ratio:.3g} times the value that follows from inductance and time constant of the step",
            procedure=resistance.procedure,
            ratio=ratio.value,
        )
        for notice in _alarm("consistency-time-constant", named, message):
            yield (notice.identifier, resistance.procedure), notice


def _step_is_off(loops: _Ratios, wrong_loops: _Ratios, against: _Ratios, wrong_bridges: _Ratios) -> bool:
    """Tell whether the step's inductance stands alone against all that the others say, and those agree."""
    if not against or len(wrong_bridges) < len(against) or len(wrong_loops) < len(loops):
        return False
    first = against[0][1]
    others = [ratio.over(first) for _, ratio in against[1:]]
    # Its error stands in both ratios: seen from bridge and resistance it cancels.
    others += [loop.over(first.inverse()) for _, loop in loops]
    return bool(others) and not any(ratio.deviates(_COPPER_SLACK) for ratio in others)


def _ratios(pairs: Iterable[tuple[Parameter, tuple[float, float], tuple[float, float]]]) -> _Ratios:
    """Return the ratio of the third to the second of each, where both are above 0."""
    return [(parameter, ratio) for parameter, under, over in pairs if (ratio := quotient(over, under)) is not None]


def _bridges_alone(bridges: Sequence[Parameter]) -> Iterator[_Keyed]:
    """Without a step there are two readings at most, and either may be off."""
    if len(bridges) < 2:
        return
    ratio = quotient(_pair(bridges[1]), _pair(bridges[0]))
    if ratio is not None and ratio.deviates(_IRON_SLACK):
        named = (*ratio.shows(factor_errors.INDUCTANCE), *ratio.inverse().shows(factor_errors.INDUCTANCE))
        yield from _inductance_alarm(bridges[1], named, ratio)


def _inductance_alarm(parameter: Parameter, named: Sequence[Text], ratio: Ratio) -> Iterator[_Keyed]:
    message = text(
        "{procedure}: the inductance is {ratio:.3g} times what the other procedures find",
        procedure=parameter.procedure,
        ratio=ratio.value,
    )
    for notice in _alarm("consistency-inductance", named, message):
        yield (notice.identifier, parameter.procedure), notice


def _type_values(found: ParameterSet, nameplate: Nameplate, pairs: float, definitions: ParameterTable) -> list[Notice]:
    """Hold what was measured against the type values."""
    alarms: list[Notice] = []
    for name, expected in nameplate.expected.items():
        definition, parameter = definitions.get(name), found.parameters.get(name)
        if definition is None or parameter is None or parameter.source != "measured":
            continue
        candidates = factor_errors.of_type_value(definition.factor_errors, pairs)
        ratio = quotient(_pair(parameter), (expected, 0.0))
        if ratio is None or not ratio.deviates(_TYPE_SLACK):
            continue
        alarms += _alarm(
            "consistency-expected",
            ratio.shows(candidates, _TYPE_WINDOW),
            text(
                "{name} is {ratio:.3g} times the type value under [expected]", name=definition.label, ratio=ratio.value
            ),
        )
    return alarms


def _alarm(identifier: str, named: Sequence[Text], said: Text) -> list[Notice]:
    if not named:
        return []
    return [Notice(identifier, text("{said}. Likely: {mistakes}", said=said, mistakes=_either(named)))]


def _either(named: Sequence[Text]) -> Text:
    """Return the mistakes as one sentence, the likeliest first; more than three say nothing."""
    sentence = named[0]
    for other in named[1:3]:
        sentence = text("{first}; or {second}", first=sentence, second=other)
    return sentence


def _figures(found: ParameterSet, name: str) -> tuple[Parameter, ...]:
    best = found.parameters.get(name)
    return () if best is None else (best, *found.alternatives.get(name, ()))


def _measured_torque_constant(found: ParameterSet) -> _Pair | None:
    return next((_pair(p) for p in _figures(found, "torque_constant") if p.estimator != DERIVED), None)


def _against_flux(found: ParameterSet, figure: _Pair | None, factor: float) -> Ratio | None:
    flux = found.parameters.get("flux_linkage")
    if flux is None or figure is None:
        return None
    return quotient(figure, (factor * flux.value, factor * flux.standard_uncertainty))


def _pair(parameter: Parameter) -> _Pair:
    return parameter.value, parameter.standard_uncertainty


def _value(found: ParameterSet, name: str) -> float:
    parameter = found.parameters.get(name)
    return parameter.value if parameter else 0.0
