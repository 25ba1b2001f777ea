"""What a bridge reads is held against figures of other instruments within its own limit of error."""

import pytest

from drivers.interfaces import Accuracy, ImpedanceReading
from procedures.core.actions import Connect, Socket, Terminal
from procedures.estimation.fitting.intervals import Interval
from procedures.estimation.winding.wiring import Pole, WiringOutcome
from procedures.verification import bridge_evidence
from procedures.verification.lines import Lines

ALIGNED = Connect({Terminal.A: Socket.METER_HIGH, Terminal.B: Socket.METER_LOW, Terminal.C: Socket.METER_LOW})
PHASE, LIMIT = 0.016, 3.2e-3


def reading(resistance: float) -> ImpedanceReading:
    accuracy = Accuracy(gain=1e-3, offset=LIMIT, resolution=1e-7)
    return ImpedanceReading(resistance, 1e-4, 20.0, accuracy, accuracy, 0.0)


@pytest.mark.parametrize("share", [-1.0, -0.7, 0.0, 0.7, 1.0])
def test_a_bridge_within_its_limits_raises_no_alarm_against_four_wires(share: float) -> None:
    lines = Lines()
    lines.read_by_four_wires([2.0 * PHASE] * 3, 1e-3)
    told = bridge_evidence.judged(ALIGNED, reading(1.5 * PHASE + share * LIMIT), lines.for_bridge({}))
    assert told.outcome is not WiringOutcome.WRONG


def test_against_its_own_lines_it_tells_one_connection_from_another() -> None:
    lines = Lines()
    lines.read_by_bridge([2.0 * PHASE + 0.7 * LIMIT] * 3, 1e-3, 20.0)
    told = bridge_evidence.judged(ALIGNED, reading(2.0 * PHASE + 0.7 * LIMIT), lines.for_bridge({}))
    assert told.outcome is WiringOutcome.WRONG


def test_a_winding_holds_what_direct_current_found_and_may_have_cooled() -> None:
    lines, poles = Lines(), (Pole.PLUS, Pole.MINUS, Pole.MINUS)
    assert lines.direct(poles) is None
    found = []
    for temperature in (22.0, 45.0):
        lines.read_by_four_wires([2.0 * PHASE] * 3, 1e-3, temperature=temperature)
        held = lines.direct(poles)
        assert held is not None
        found.append(held)
    cold, warm = found
    assert cold.high == warm.high == pytest.approx(1.001 * 1.5 * PHASE)
    assert cold.low == pytest.approx(1.5 * PHASE * (1.0 - 1e-3 - 0.00393 * 2.0))
    assert warm.low == pytest.approx(1.5 * PHASE * (1.0 - 1e-3 - 0.00393 * 22.0))


@pytest.mark.parametrize(("contacts", "known"), [(0.0, True), (0.03, True), (0.2, False)])
def test_lines_whose_contacts_differ_are_held_against_less_or_nothing(contacts: float, known: bool) -> None:
    lines = Lines()
    lines.read_by_bridge((0.16, 0.16, 0.16), 0.002, 20.0, contacts=contacts)
    lines.suppose("lcr_meter", (Pole.PLUS, Pole.MINUS, Pole.OPEN), Interval(0.15, 0.17))
    for found in (lines.for_bridge({}), lines.for_supply({}, 0.05)):
        assert (found is not None) is known
        if found is not None:
            assert found.tolerance >= 0.08 + contacts
    if not known:
        assert lines.supposed_for_bridge() is None
