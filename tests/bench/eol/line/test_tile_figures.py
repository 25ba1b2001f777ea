import math
from typing import Any

from bench.eol.line.tile_figures import tile_figures
from bench.eol.record import MeasuredFigure
from bench.eol.verdict import Verdict
from tests.bench.eol.motor_records import motor_record

INF = math.inf


def figure(name: str, value: float, low: float, high: float, verdict: Verdict, unit: str = "Ω") -> MeasuredFigure:
    return MeasuredFigure(name, value, unit, 1e-5, 2e-5, low, high, verdict)


def told(*figures: MeasuredFigure) -> dict[str, Any]:
    return tile_figures(motor_record(measured=figures))


def test_a_tile_tells_what_is_outside_in_a_readers_units_and_where_it_lies() -> None:
    said = told(
        figure("stator_resistance", 0.0349, 0.031, 0.033, Verdict.FAIL),
        figure("d_axis_inductance", 75e-6, 70e-6, 80e-6, Verdict.PASS, "H"),
        figure("inertia", 6.1e-5, 5e-5, INF, Verdict.PASS, "kg·m²"),
        figure("coulomb_friction", 0.02, -INF, INF, Verdict.PASS, "N·m"),
    )
    (outside,) = said["outside"]
    assert (outside["value"], outside["unit"], outside["low"], outside["high"]) == ("34.900", "mΩ", "31.000", "33.000")
    # Two limits stand at a quarter and three quarters; what is further out than half their distance stands at the edge.
    assert outside["place"] == 1.0
    assert (said["inside"], said["limited"]) == (2, 3)
    assert said["closest"]["left"] == 100.0


def test_the_nearest_to_a_limit_is_named_only_where_both_limits_are_there() -> None:
    near = figure("flux_linkage", 8.9e-3, 8.0e-3, 9.0e-3, Verdict.PASS, "V·s/rad")
    middle = figure("stator_resistance", 0.032, 0.031, 0.033, Verdict.PASS)
    assert told(near, middle)["closest"]["left"] == 20.0
    assert told(figure("inertia", 6.1e-5, 5e-5, INF, Verdict.PASS, "kg·m²"))["closest"] is None
    assert told()["limited"] == 0
