"""Lines that are read once more: chance, a winding that cools, contacts."""

import numpy as np
import pytest

from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.winding.closing import (
    ReadAgain,
    contacts_made_anew,
    four_wires_again,
    read_again,
    unsettled,
)

NOISE = 5e-5


def bridge(factors: tuple[float, float, float], seed: int) -> list[ReadAgain]:
    """Three readings of three lines at 0, 17 and 34 s, and again 51 s later, where they are these times as large."""
    random = np.random.default_rng(seed)
    first = [list(1.0 + NOISE * random.standard_normal(3)) for _ in range(3)]
    last = [list(f * (1.0 + NOISE * random.standard_normal(3))) for f in factors]
    return [
        read_again(first[k], last[k], [first[j] for j in range(3) if j != k], seconds=51.0, coarseness=1e-6)
        for k in range(3)
    ]


@pytest.mark.parametrize("factor", [1.0, 0.9997, 4.0])
def test_readings_typed_from_a_list_tell_no_time_to_cool_in(factor: float) -> None:
    again = read_again([1.0, 1.0, 1.0], [factor] * 3, [[1.0] * 3, [1.0] * 3], seconds=0.0, coarseness=1e-6)
    found = unsettled([again], "stator_resistance")
    assert np.isfinite(found.excess)
    assert all(each.cause is Cause.CONTACT for each in found.misfit.findings)


def test_lines_that_stay_are_not_doubted() -> None:
    alarms = sum(bridge((1.0, 1.0, 1.0), seed)[0].unexplained for seed in range(400))
    assert alarms <= 8
    assert not unsettled(bridge((1.0, 1.0, 1.0), 1)[:1], "stator_resistance").misfit


@pytest.mark.parametrize(("hidden", "time_constant"), [(1.5, 300.0), (3.0, 2000.0), (15.0, 2000.0), (40.0, 600.0)])
def test_a_winding_that_cools_is_told_and_its_hidden_warmth_held(hidden: float, time_constant: float) -> None:
    falls = 1.0 + 0.0039 * hidden * (np.exp(-51.0 / time_constant) - 1.0)
    found = unsettled(bridge((falls, falls, falls), 2), "stator_resistance")
    (finding,) = found.misfit.findings
    assert (finding.cause, found.warm) == (Cause.WARM_WINDING, True)
    assert found.excess >= 0.0039 * hidden
    assert (finding.answer is Answer.WITHHELD) == (found.excess > 0.05)


def test_contacts_that_come_out_otherwise_are_told_and_held() -> None:
    random, held, told = np.random.default_rng(3), 0, 0
    for seed in range(200):
        once, more = (0.003 * np.exp(0.5 * random.standard_normal(3)) for _ in range(2))
        found = unsettled(bridge(tuple((1.0 + more) / (1.0 + once)), seed), "stator_resistance")
        if found.misfit:
            told += found.misfit.findings[0].cause is Cause.CONTACT
        held += found.excess >= float(np.mean(once))
    # Where contacts come out alike by chance, or fall alike, they cannot be told from a winding.
    assert held >= 180
    assert told >= 180


def four_wires(resistance: np.ndarray, offset: float = 1e-4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Five levels with plus and five with minus, the current read with 0.2 % of noise."""
    levels = np.array([1.0, 0.75, 0.5, 0.25, 1.0])
    current = np.concatenate((levels, -levels))
    read = current * (1.0 + 2e-3 * np.random.default_rng(4).standard_normal(10))
    return np.linspace(0.0, 20.0, 10), read, resistance * current + offset


def test_a_supplys_noise_does_not_hide_a_change() -> None:
    began, last = four_wires(np.ones(10)), four_wires(np.full(10, 0.999), offset=3e-4)
    again = four_wires_again(began, (last[0] + 136.0, last[1], last[2]))
    assert again.change == pytest.approx(-1e-3, rel=0.02)
    assert again.seconds == pytest.approx(136.0)
    assert again.unexplained


def test_what_the_current_warms_is_no_contact() -> None:
    warming = 1.0 + 1e-5 * np.arange(10)
    again = four_wires_again(four_wires(warming), four_wires(warming + 3.5e-4))
    assert again.change == pytest.approx(3.5e-4, rel=0.05)
    assert not again.unexplained


def test_a_rise_that_warmth_explains_is_a_contact_s_where_other_lines_fall() -> None:
    risen = ReadAgain(1e-3, 1e-4, 8.0, 100.0, explained=2e-3)
    assert risen.changed
    assert not risen.unexplained
    assert not unsettled([risen], "stator_resistance").misfit
    others = [ReadAgain(change, 1e-4, 8.0, 100.0, explained=2e-3) for change in (-1.2e-3, -6e-3)]
    found = unsettled([risen, *others], "stator_resistance")
    assert [finding.cause for finding in found.misfit.findings] == [Cause.CONTACT]
    assert found.excess > 6e-3


def test_lines_that_two_instruments_compare_otherwise_have_contacts() -> None:
    random, held, told = np.random.default_rng(5), 0, 0
    for _ in range(200):
        lines = 1.0 + 0.01 * random.standard_normal(3)
        contact = 0.01 * np.exp(0.5 * random.standard_normal((2, 3)))
        before, now = lines * (1.0 + contact[0]) * 1.03, lines * (1.0 + contact[1])
        found = contacts_made_anew(before, now, 5e-4)
        told += bool(found.misfit)
        held += not found.misfit or np.mean(contact[1]) <= found.excess
    assert told >= 160
    assert held >= 190


@pytest.mark.parametrize("suspected", [False, True])
def test_an_instrument_s_gain_and_a_warm_winding_are_no_contacts(*, suspected: bool) -> None:
    random = np.random.default_rng(6)
    told = 0
    for _ in range(200):
        lines = 1.0 + 0.01 * random.standard_normal(3)
        now = 1.04 * lines * (1.0 + 2e-4 * random.standard_normal(3))
        told += bool(contacts_made_anew(lines, now, 2e-4, suspected=suspected).misfit)
    assert told <= (10 if suspected else 2)


def test_a_winding_that_cools_from_line_to_line_is_no_contact_unless_those_are_suspected() -> None:
    cooling = (1.0, 0.99, 0.98)
    assert not contacts_made_anew((1.0, 1.0, 1.0), cooling, 3e-4).misfit
    (found,) = contacts_made_anew((1.0, 1.0, 1.0), cooling, 3e-4, suspected=True).misfit.findings
    assert (found.cause, found.answer) == (Cause.CONTACT, Answer.WITHHELD)


@pytest.mark.parametrize("explained", [0.0, 0.01])
def test_a_rise_that_is_hardly_more_than_chance_is_in_the_interval(explained: float) -> None:
    """A contact made anew that adds more than the first time, which warming by the current would explain as well."""
    rise = ReadAgain(3.3e-4, 1.4e-4, 7.0, 50.0, explained)
    assert not rise.unexplained
    found = unsettled([rise], "stator_resistance")
    assert not found.misfit
    assert not found.warm
    assert 3.3e-4 <= found.excess <= 1e-3
    assert found.contacts == 0.0
    chance = ReadAgain(1.4e-4, 1.4e-4, 7.0, 50.0, explained)
    assert unsettled([chance], "stator_resistance").excess == 0.0
