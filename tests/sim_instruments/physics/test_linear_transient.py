"""Closed forms of a standing rotor's circuit against their definitions."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from sim_instruments.physics.circuits.crossing import first_rise
from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import CurrentSource, Source, VoltageSource
from sim_instruments.physics.circuits.transient import LinearTransient
from sim_instruments.physics.circuits.windings import Windings

WIRINGS = [
    ("supply+", "supply-", "open"),
    ("supply+", "supply-", "supply-"),
    ("supply+", "supply-", "free"),
]


def transient(lab: Any, delta: bool, sockets: tuple[str, ...], angle: float, source: Source) -> LinearTransient:
    motor = lab.outrunner(q_axis_inductance=90e-6) if delta else lab.lg_400w(q_axis_inductance=120e-6)
    network = Network(Windings(motor, 40.0), sockets, ("supply+", "supply-"), source_resistance=0.01)
    begin = np.linspace(0.5, 1.5, network.loops)
    return LinearTransient(network, angle, 2.0, begin, source)


circuits = st.tuples(st.booleans(), st.sampled_from(WIRINGS), st.floats(0.0, 6.3))


@given(circuit=circuits, duration=st.floats(1e-5, 0.5))
def test_copper_heat_is_the_integral_of_the_loss(lab: Any, circuit: Any, duration: float) -> None:
    for source in (VoltageSource(2.0, 0.3), CurrentSource(2.0)):
        course = transient(lab, *circuit, source)
        resistance = course.network.windings.resistance

        def loss(passed: float, course: Any = course, resistance: Any = resistance) -> float:
            return float(resistance @ course.winding_currents(np.array([2.0 + passed]))[:, 0] ** 2)

        points = [duration * share for share in np.geomspace(1e-5, 0.5, 12)]
        expected = quad(loss, 0.0, duration, points=points, limit=200, epsrel=1e-10)[0]
        assert course.copper_heat(duration) == pytest.approx(expected, rel=1e-7)


def test_copper_heat_under_a_running_voltage_is_not_told(lab: Any) -> None:
    course = transient(lab, False, WIRINGS[1], 0.3, VoltageSource(2.0, 0.1, 5.0))
    assert course.copper_heat(0.1) is None


@given(circuit=circuits, passed=st.lists(st.floats(0.0, 0.2), min_size=1, max_size=5))
def test_the_sources_course_is_that_of_the_whole_circuit(lab: Any, circuit: Any, passed: list[float]) -> None:
    times = 2.0 + np.array(passed)
    for source in (VoltageSource(2.0, 0.3), VoltageSource(2.0, 0.3, -2.0), CurrentSource(2.0)):
        course = transient(lab, *circuit, source)
        if isinstance(source, VoltageSource):
            expected = course.network.source_current(course.winding_currents(times))
        else:
            expected = course.source_voltage(times)
        assert course.source_course().at(times) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(circuit=circuits, level=st.floats(-5.0, 5.0), sense=st.sampled_from([1, -1]))
def test_what_stays_below_its_level_never_passes_it(lab: Any, circuit: Any, level: float, sense: int) -> None:
    times = 2.0 + np.concatenate([[0.0], np.geomspace(1e-7, 1.0, 400)])
    for source in (VoltageSource(2.0, 0.05), VoltageSource(2.0, 0.05, 1.0), CurrentSource(1.0)):
        course = transient(lab, *circuit, source).source_course()
        if course.stays_below(level, sense):
            assert np.all(sense * course.at(times) < sense * level)


@given(circuit=circuits, level=st.floats(-5.0, 40.0), sense=st.sampled_from([1, -1]), until=st.floats(2.0, 4.0))
def test_a_level_is_passed_when_the_course_shows_it(
    lab: Any, circuit: Any, level: float, sense: int, until: float
) -> None:
    for source in (VoltageSource(2.0, 0.5), VoltageSource(2.0, 0.05, 1.0), CurrentSource(1.0)):
        transients = transient(lab, *circuit, source)
        course = transients.source_course()
        found = course.passing(level, sense, until)
        if found is not None:
            seen = first_rise(lambda t, c=course: sense * (c.at(t) - level), 2.0, until, 1.0 / transients.rates)
            assert found == pytest.approx(seen, abs=1e-12)


@given(circuit=circuits, frequency=st.sampled_from([20.0, 1e3, 1e5]))
def test_the_bridges_impedance_is_that_of_the_solved_loops(lab: Any, circuit: Any, frequency: float) -> None:
    network = transient(lab, *circuit, CurrentSource(1.0)).network
    angle = 2.0 * math.pi * frequency
    matrix = network.damping + 1j * angle * network.inertance(circuit[2])
    expected = 1.0 / (network.drive @ np.linalg.solve(matrix, network.drive))
    found = network.driving_point_impedance(np.array([circuit[2]]), angle)
    assert found[0] == pytest.approx(expected, rel=1e-10)


def test_a_settled_circuit_stays_as_it_is(lab: Any) -> None:
    early = transient(lab, False, WIRINGS[1], 0.3, VoltageSource(2.0, 0.3))
    assert not early.settled
    late = early.loop_currents(np.array([12.0]))[:, 0]
    assert LinearTransient(early.network, 0.3, 12.0, late, VoltageSource(12.0, 0.3)).settled
