"""The document's example at 0.5 N·m (section 7, tables 1 and 2; errata E12 to E14)."""

import math
from dataclasses import replace

import pytest

from sim_instruments.six_step.balance import branches, equivalent_resistance, losses, supply_voltages
from sim_instruments.six_step.circuit import Observables
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import SteadyState, steady_state


@pytest.fixture(scope="module")
def point(bridge: Bridge) -> SteadyState:
    return balance_load(bridge, 0.5)


def test_speed_and_both_tables(point: SteadyState) -> None:
    assert point.speed * 30 / math.pi == pytest.approx(3256, rel=0.002)
    assert point.state_time == pytest.approx(0.7678e-3, rel=0.002)
    found = branches(point)
    for name in ("c", "ab"):
        branch = found[name]
        assert branch.emf == pytest.approx(19.95604, rel=0.005)
        assert branch.resistance == pytest.approx(0.67417, rel=0.005)
        assert branch.self_inductance == pytest.approx(2.03029, rel=0.005)
        assert branch.mutual_inductance == pytest.approx((-0.11482, 0.22955), rel=0.005)
        assert branch.terminal == pytest.approx(22.7753, rel=0.005)
    current = point.averages[Observables.currents]
    assert -current[2] == pytest.approx(5.88074, rel=0.005)
    assert current[1] == pytest.approx(2.51451, rel=0.005)
    supply = supply_voltages(point)
    assert point.average_supply_current == pytest.approx(8.39525, rel=0.005)
    assert supply.switches_at_supply_current == pytest.approx(0.503715, rel=0.005)
    assert supply.source_resistance == pytest.approx(1.041001, rel=0.005)
    assert supply.source == 24.32


def test_terminal_voltage_is_the_sum_of_its_parts(point: SteadyState) -> None:
    for branch in branches(point).values():
        parts = branch.emf + branch.resistance + branch.self_inductance + sum(branch.mutual_inductance)
        assert parts == pytest.approx(branch.terminal, rel=1e-12)
    supply = supply_voltages(point)
    c_branch = branches(point)["c"]
    assert c_branch.terminal + supply.switches + supply.source_resistance == pytest.approx(24.32, rel=1e-12)


def test_freewheel_through_t1_is_what_the_document_leaves_out(point: SteadyState, example: SixStepDrive) -> None:
    supply = supply_voltages(point)
    first = point.segments[0]
    idle = first.integrals(first.circuit.observables)[Observables.line_currents][1] / point.state_time
    excess = supply.switches - supply.switches_at_supply_current
    assert excess == pytest.approx(-example.switch_resistance * idle, rel=1e-9)
    # With the switches' resistance in the supply's lead, as the table's sum has it, the speed is the document's.
    lead = replace(example, switch_resistance=0.0, source_resistance=example.source_resistance + 0.06)
    assert balance_load(Bridge(lead), 0.5).speed * 30 / math.pi == pytest.approx(3256, rel=3e-4)


@pytest.mark.parametrize("speed_rpm", [1000.0, 3256.0, 4500.0])
def test_half_in_the_inductive_resistance_closes_the_power_balance(bridge: Bridge, speed_rpm: float) -> None:
    steady = steady_state(bridge, speed_rpm * math.pi / 30)
    average = steady.averages[Observables.currents]
    products = steady.product_averages
    for winding in (0, 2):  # b ends at the current it starts from, reversed
        effective, inductive = equivalent_resistance(steady, winding)
        taken = products[6 + winding, winding]
        converted = products[3 + winding, winding]
        with_half = converted + average[winding] ** 2 * (effective + inductive)
        without = converted + average[winding] ** 2 * (effective + 2 * inductive)
        assert with_half == pytest.approx(taken, rel=1e-9, abs=1e-9)
        assert abs(without - taken) > 0.005 * abs(taken)


def test_inductive_resistance_exceeds_the_windings_and_is_no_loss(point: SteadyState, example: SixStepDrive) -> None:
    effective, inductive = equivalent_resistance(point, 2)
    assert inductive > example.resistance
    # Copper loss takes I_eff alone; over all windings the exchanged energy cancels.
    current = point.averages[Observables.currents]
    pairs = [equivalent_resistance(point, k) for k in range(3)]
    assert sum(r * i * i for (r, _), i in zip(pairs, current, strict=True)) == pytest.approx(losses(point).copper)
    assert sum(x * i * i for (_, x), i in zip(pairs, current, strict=True)) == pytest.approx(0.0, abs=1e-9)
    assert effective > example.resistance


def test_inductive_resistance_grows_with_speed(bridge: Bridge) -> None:
    found = [equivalent_resistance(balance_load(bridge, load), 2)[1] for load in (1.5, 1.2, 0.8, 0.5, 0.3)]
    assert found == sorted(found)
