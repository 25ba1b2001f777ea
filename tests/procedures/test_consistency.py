"""A healthy motor raises no alarm; each mistake raises one, and it is named."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.parameter_set import merge
from procedures.core.result import Notice, Parameter, ProcedureResult
from procedures.note.torque_constant import DERIVED
from procedures.plausibility.consistency import check_consistency

POLE_PROCEDURES = ("pole-pairs-static", "pole-pairs-inverter", "pole-pairs-back-emf")
BRIDGES = ("dq-inductance-extremes", "dq-inductance-aligned")
STEP = "dq-inductance-time-constant"
RESISTANCES = ("stator-resistance-dc", "stator-resistance")


@dataclass
class Bench:
    """Figures of a run by procedure and name, (value, relative standard uncertainty); tests change them as a mistake would."""

    figures: dict[tuple[str, str], tuple[float, float]]
    time_constants: dict[str, float]
    plate: Nameplate
    known: set[str] = field(default_factory=set)

    def scale(self, factor: float, name: str, *procedures: str) -> None:
        for key, (value, uncertainty) in self.figures.items():
            if key[1] == name and (not procedures or key[0] in procedures):
                self.figures[key] = (value * factor, uncertainty)

    def drop(self, *procedures: str) -> None:
        self.figures = {key: figure for key, figure in self.figures.items() if key[0] not in procedures}

    def alarms(self) -> tuple[Notice, ...]:
        results: dict[str, list[Parameter]] = {}
        for (procedure, name), (value, relative) in self.figures.items():
            results.setdefault(procedure, []).append(parameter(name, value, relative * abs(value), procedure))
        flux, pairs = (
            self.figures.get(("back-emf-constant", "flux_linkage")),
            self.figures.get((POLE_PROCEDURES[0], "pole_pairs")),
        )
        if flux and pairs and "torque-constant" in results:
            derived = parameter("torque_constant", 1.5 * pairs[0] * flux[0], 1e-9, "torque-constant", DERIVED)
            results["torque-constant"].append(derived)
        found = merge([ProcedureResult(name, "3", tuple(given)) for name, given in results.items()])
        findings: dict[str, Any] = {
            STEP: {axis: {"time_constant": tau} for axis, tau in self.time_constants.items()} if STEP in results else {}
        }
        return check_consistency(found, findings, self.plate)


def parameter(name: str, value: float, uncertainty: float, procedure: str, estimator: str = "e") -> Parameter:
    return Parameter(name, value, "", uncertainty, math.inf, (value, value), procedure, "3", estimator)


def bench(
    *,
    pairs: int = 4,
    resistance: float = 0.016,
    inductances: tuple[float, float] = (73e-6, 76.5e-6),
    flux: float = 8.5e-3,
    electrical_speed: float = 1250.0,
    current: float = 29.0,
    share: float = 0.8,
    leads: float = 1.03,
    type_value: float = 1.1,
    uncertainty: Callable[[], float] = lambda: 0.003,
    error: Callable[[], float] = lambda: 0.0,
) -> Bench:
    """A motor whose figures are off by `error` standard uncertainties each; full torque takes `share` of the rated voltage."""

    def measured(truth: float) -> tuple[float, float]:
        u = uncertainty()
        return truth * (1.0 + error() * u), u

    figures = {(procedure, "pole_pairs"): (float(pairs), 0.0) for procedure in POLE_PROCEDURES}
    for procedure in RESISTANCES:
        figures[procedure, "stator_resistance"] = measured(resistance)
    for axis, inductance in zip("dq", inductances, strict=True):
        for procedure in (*BRIDGES, STEP):
            figures[procedure, f"{axis}_axis_inductance"] = measured(inductance)
    figures["back-emf-constant", "flux_linkage"] = measured(flux)
    figures["back-emf-constant", "back_emf_constant_mechanical"] = measured(pairs * flux)
    figures["torque-constant", "torque_constant"] = measured(1.5 * pairs * flux)
    phase = math.hypot(electrical_speed * flux + resistance * current, electrical_speed * inductances[1] * current)
    plate = Nameplate(
        "m",
        WindingConnection.WYE,
        rated_current=current,
        rated_speed_rpm=electrical_speed / pairs * 30.0 / math.pi,
        rated_voltage=math.sqrt(3.0) * phase / share,
        pole_pairs=pairs,
        expected={"stator_resistance": type_value * resistance, "flux_linkage": flux / type_value},
    )
    taus = {axis: inductance / (resistance * leads) for axis, inductance in zip("dq", inductances, strict=True)}
    return Bench(figures, taus, plate)


@pytest.mark.slow
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(st.data())
def test_a_healthy_motor_raises_no_alarm(data: st.DataObject) -> None:
    low = data.draw(st.floats(1e-5, 50e-3))
    made = bench(
        pairs=data.draw(st.integers(1, 24)),
        resistance=data.draw(st.floats(0.01, 20.0)),
        inductances=(low, low * data.draw(st.floats(1.0, 3.0))),
        flux=data.draw(st.floats(1e-4, 1.0)),
        electrical_speed=data.draw(st.floats(50.0, 5000.0)),
        current=data.draw(st.floats(0.1, 100.0)),
        share=data.draw(st.floats(0.45, 1.3)),
        leads=data.draw(st.floats(0.95, 1.2)),
        type_value=data.draw(st.floats(0.8, 1.25)),
        uncertainty=lambda: data.draw(st.floats(1e-5, 0.1)),
        error=lambda: data.draw(st.floats(-3.5, 3.5)),
    )
    if data.draw(st.booleans()):
        made.drop(data.draw(st.sampled_from([*POLE_PROCEDURES, *BRIDGES, STEP, *RESISTANCES, "torque-constant"])))
    assert made.alarms() == ()


def flux_and_emf(factor: float) -> Callable[[Bench], None]:
    def change(made: Bench) -> None:
        made.scale(factor, "flux_linkage")
        made.scale(factor, "back_emf_constant_mechanical")

    return change


def scaled(factor: float, name: str, *procedures: str) -> Callable[[Bench], None]:
    return lambda made: made.scale(factor, name, *procedures)


def both_axes(factor: float, *procedures: str) -> Callable[[Bench], None]:
    def change(made: Bench) -> None:
        made.scale(factor, "d_axis_inductance", *procedures)
        made.scale(factor, "q_axis_inductance", *procedures)

    return change


def per_mechanical_radian(made: Bench) -> None:
    made.scale(made.plate.pole_pairs or 1, "flux_linkage")


def all_count_poles(made: Bench) -> None:
    made.scale(2.0, "pole_pairs")
    made.plate = replace(made.plate, pole_pairs=None)


def plate_says_poles(made: Bench) -> None:
    made.plate = replace(made.plate, pole_pairs=2 * (made.plate.pole_pairs or 1))


def one_against_one(made: Bench) -> None:
    """The only count is of poles, and the plate is right: what bears it out is the torque constant."""
    made.drop(*POLE_PROCEDURES[1:])
    made.scale(2.0, "pole_pairs")


TORQUE, POLES, L, TAU = (
    "consistency-torque-constant",
    "consistency-pole-pairs",
    "consistency-inductance",
    "consistency-time-constant",
)
MISTAKES: dict[str, tuple[Callable[[Bench], None], str, str]] = {
    "rms for peak": (scaled(math.sqrt(2.0), "torque_constant"), TORQUE, "rms current entered for peak"),
    "peak for rms": (scaled(math.sqrt(0.5), "torque_constant"), TORQUE, "peak current taken for rms"),
    "1.5 twice": (scaled(1.5, "torque_constant"), TORQUE, "1.5 of the amplitude-invariant torque counted twice"),
    "1.5 missing": (scaled(1 / 1.5, "torque_constant"), TORQUE, "1.5 of the amplitude-invariant torque left out"),
    "line for phase": (flux_and_emf(math.sqrt(3.0)), TORQUE, "line voltage entered for phase voltage"),
    "phase for line": (flux_and_emf(1 / math.sqrt(3.0)), TORQUE, "phase voltage taken for line voltage"),
    "peak to peak": (flux_and_emf(2.0), TORQUE, "peak-to-peak voltage entered for peak"),
    "probe": (flux_and_emf(10.0), TORQUE, "a probe's attenuation of 10"),
    "mechanical speed": (per_mechanical_radian, TORQUE, "mechanical speed taken for electrical speed"),
    "Hz for rad/s": (scaled(2 * math.pi, "flux_linkage"), TORQUE, "Hz taken for rad/s: a factor 2π"),
    "rad/s for Hz": (scaled(0.5 / math.pi, "flux_linkage"), TORQUE, "rad/s taken for Hz: a factor 2π"),
    "all count poles": (all_count_poles, TORQUE, "poles entered for pole pairs"),
    "plate says poles": (plate_says_poles, POLES, "poles counted for pole pairs"),
    "one counts poles": (scaled(2.0, "pole_pairs", POLE_PROCEDURES[0]), POLES, "poles counted for pole pairs"),
    "one counts half": (scaled(0.5, "pole_pairs", POLE_PROCEDURES[1]), POLES, "every other position or period missed"),
    "one against one": (one_against_one, POLES, "poles counted for pole pairs"),
    "rpm in the EMF constant": (
        scaled(math.pi / 30, "back_emf_constant_mechanical"),
        "consistency-emf",
        "rpm taken for rad/s in the EMF constant",
    ),
    "halved A to B and C": (both_axes(0.75, BRIDGES[1]), L, "halved instead of divided by 1.5 (E1)"),
    "line by 1.5": (both_axes(4 / 3, BRIDGES[0]), L, "a reading between two lines divided by 1.5"),
    "not divided by 1.5": (both_axes(1.5, BRIDGES[1]), L, "A against B and C together not divided by 1.5"),
    "line not halved": (both_axes(2.0, BRIDGES[0]), L, "a reading between two lines not halved"),
    "winding of a delta": (both_axes(3.0, BRIDGES[0]), L, "wye and delta confused"),
    "wye for delta": (both_axes(1 / 3, BRIDGES[1]), L, "a wye divided by 3 as if it were a delta"),
    "the step itself": (both_axes(1.5, STEP), L, "A against B and C together not divided by 1.5"),
    "line resistance": (scaled(2.0, "stator_resistance", RESISTANCES[0]), TAU, "between two lines entered"),
    "resistance of a winding": (scaled(3.0, "stator_resistance", RESISTANCES[1]), TAU, "wye and delta confused"),
    "resistance halved": (scaled(0.5, "stator_resistance", RESISTANCES[1]), TAU, "halved once more"),
}


@pytest.mark.parametrize("name", MISTAKES)
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_each_mistake_raises_its_alarm_and_no_other(name: str, data: st.DataObject) -> None:
    change, identifier, named = MISTAKES[name]
    made = bench(
        pairs=2 * data.draw(st.sampled_from([2, 4, 5, 7, 11])),
        uncertainty=lambda: data.draw(st.floats(1e-4, 0.005)),
        error=lambda: data.draw(st.floats(-2.0, 2.0)),
    )
    change(made)
    (alarm,) = made.alarms()
    assert alarm.identifier == identifier
    likely = str(alarm.message).split("Likely: ", 1)[1].split("; or ", 1)[0]
    assert named in likely, str(alarm.message)


def test_the_step_is_known_by_who_is_wrong() -> None:
    made = bench()
    both_axes(1.5, STEP)(made)
    assert str(made.alarms()[0].message).startswith(f"{STEP}: the inductance is 1.5 times")


def test_one_bridge_without_a_resistance_leaves_both_open() -> None:
    made = bench()
    made.drop(*RESISTANCES, BRIDGES[0])
    both_axes(0.75, BRIDGES[1])(made)
    (alarm,) = made.alarms()
    assert "E1" in str(alarm.message)
    assert "a reading between two lines divided by 1.5" in str(alarm.message)


@pytest.mark.parametrize(
    ("factor", "named"),
    [
        (7.0, "per mechanical radian"),
        (1 / 7.0, "pole pairs left out"),
        (30 / math.pi, "rpm and rad/s confused"),
        (10.0, "a probe's attenuation of 10"),
    ],
)
def test_without_a_torque_constant_the_plate_bears_witness(factor: float, named: str) -> None:
    made = bench(pairs=7)
    made.drop("torque-constant")
    flux_and_emf(factor)(made)
    (alarm,) = made.alarms()
    assert alarm.identifier == "consistency-plate"
    assert named in str(alarm.message)


@pytest.mark.parametrize(
    ("expected", "named"),
    [
        ({"stator_resistance": 2 * 0.016}, "the type value holds between two lines"),
        ({"stator_resistance": 3 * 0.016}, "wye and delta confused"),
        ({"d_axis_inductance": 0.073}, "a factor 1000"),
        ({"flux_linkage": math.sqrt(3.0) * 8.5e-3}, "or is that of a delta's winding"),
        ({"torque_constant": math.sqrt(2.0) * 0.051}, "per rms ampere"),
    ],
)
def test_type_values_show_plain_factors(expected: dict[str, float], named: str) -> None:
    made = bench()
    made.plate = replace(made.plate, expected=expected)
    (alarm,) = made.alarms()
    assert alarm.identifier == "consistency-expected"
    assert named in str(alarm.message)


@pytest.mark.parametrize(("factor", "scaled"), [(1000.0, "stator_resistance"), (1000.0, "d_axis_inductance")])
def test_a_prefix_left_out_everywhere_is_seen_by_the_plate(factor: float, scaled: str) -> None:
    made = bench()
    made.plate = replace(made.plate, rated_voltage=48.0, rated_speed_rpm=3000.0, rated_current=10.0)
    made.scale(factor, scaled)
    said = [str(alarm.message) for alarm in made.alarms() if alarm.identifier == "consistency-winding"]
    assert len(said) == 1
    assert "without their prefix, mΩ as Ω or mH as H" in said[0]


def test_what_is_hardly_known_decides_nothing() -> None:
    made = bench(uncertainty=lambda: 0.18)
    made.scale(2.0, "torque_constant")
    assert made.alarms() == ()


def test_nothing_measured_nothing_to_say() -> None:
    assert check_consistency(merge([]), {}, Nameplate("m", WindingConnection.WYE, rated_current=1.0)) == ()
