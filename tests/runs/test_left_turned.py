"""Short circuit, open circuit and load points that are left under way: what they had taken is told, within its uncertainty."""

from dataclasses import replace

import pytest

from drivers.interfaces.text import text
from procedures.maps import load_run, open_circuit, short_run
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure, within
from tests.runs.test_short_circuit import FILE, LOADS, MOTOR, PLATE, QUICK, SHORT, TOP, loss


@pytest.fixture
def left(monkeypatch):
    """Run a procedure whose call number `at` of a function is interrupted, and return what it makes of what it had."""

    def run(motor, name, settings, owner, function, at):
        asked, calls = getattr(owner, function), []

        def struck(*given, **named):
            calls.append(name)
            if len(calls) == at:
                raise KeyboardInterrupt
            return asked(*given, **named)

        def partly(procedure):
            with pytest.raises(KeyboardInterrupt):
                procedure.run()
            return procedure.partial_result(text("interrupted"))

        with monkeypatch.context() as patched, VirtualBench(motor, seed=2, sockets=False) as bench:
            patched.setattr(owner, function, struck)
            return measure(bench, PLATE, name, *settings, run=partly)

    return run


def said(result):
    (notice,) = (each for each in result.warnings if each.identifier == "ended-early")
    return str(notice.message)


def test_the_flux_linkage_of_some_speeds(left):
    # Five of the tare, and three of the motor.
    result = left(MOTOR, "open-circuit", ("speeds=5", *QUICK), open_circuit, "held_torque", 9)
    assert within(result.parameter("flux_linkage"), MOTOR.flux_linkage_y)
    assert [each.name for each in result.parameters] == ["flux_linkage"]
    assert "3 of 5 speeds" in said(result)
    assert result.findings["passes"][0]["torque"] == []
    assert left(MOTOR, "open-circuit", ("speeds=5", *QUICK), open_circuit, "held_torque", 7) is None


def test_a_whole_pass_is_told_whole(left):
    result = left(MOTOR, "open-circuit", ("speeds=5", *QUICK), open_circuit.OpenCircuit, "warm", 1)
    assert within(result.parameter("flux_linkage"), MOTOR.flux_linkage_y)
    drag = MOTOR.coulomb_friction + MOTOR.viscous_friction * TOP
    assert within(result.parameter("open_circuit_loss"), drag * TOP)
    assert "1 whole passes" in said(result)


def test_the_readings_of_a_short_circuit_are_kept(left):
    result = left(MOTOR, "short-circuit", SHORT, short_run, "held_torque", 5)
    assert not result.parameters
    assert "but give no figure" in said(result)
    omega, size = (result.findings["left"][name] for name in ("electrical_speed", "current"))
    assert len(omega) == len(size) == 4
    reactance = [w * MOTOR.d_axis_inductance_y for w in omega]
    # From below λω/R up to λ/L_d.
    assert all(
        i < MOTOR.flux_linkage_y * w / max(0.2, x) * 1.01 for i, w, x in zip(size, omega, reactance, strict=True)
    )


def test_load_points_without_their_end(left):
    motor = replace(FILE.virtual_motor(), phase_resistances=(0.04, 0.04, 0.04))
    result = left(motor, "load-points", LOADS, load_run, "held_torque", 4)
    points = result.findings["points"]
    assert len(points) == 3
    for point in points:
        assert abs(point["loss"] - loss(motor, point)) < 3.0 * point["loss_uncertainty"]
        assert point["copper"] is None
    assert "3 load points were read" in said(result)
    shown = points[max(range(3), key=lambda k: abs(points[k]["electrical"]))]
    low, high = result.parameter("total_loss").coverage_interval
    assert low < loss(motor, shown) < high
    assert any("not read again" in str(row.source) for row in result.parameter("total_loss").budget)
