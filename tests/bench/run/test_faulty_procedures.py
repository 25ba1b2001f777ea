"""Procedures with a fault in them: told, and never taken for a measurement."""

import sys
from collections.abc import Callable
from typing import Any

import pytest

from bench.journal.run_view import RunView
from bench.run.plan import Planned
from drivers.interfaces.text import text
from procedures.core.bench import Role
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.steps import step
from tests.journals import event

Ran = Callable[[Callable[[Any], None]], RunView]


@pytest.fixture
def ran(make_runner: Callable[..., Any], plan: list[Planned], about: dict[str, Any]) -> Ran:
    """A run of a procedure that ends as given."""

    def run(ends: Callable[[Any], None]) -> RunView:
        last = step("9.9/3", "Compute")(ends)
        faulty = type("Faulty", (plan[0].procedure,), {"name": "faulty", "compute": last})
        view: RunView = make_runner().run([Planned("faulty", faulty, plan[0].settings)], event("run_started", **about))
        return view

    return run


def give(procedure: Any, value: float, uncertainty: float) -> None:
    # As a computation ends: no input of it is itself no number.
    quantity = value + procedure.bench.uncertainties.statistical("repeats", 0.0, uncertainty, 9.0)
    procedure.report("stator_resistance", quantity, section="9.9", estimator="none")


def leave_on(procedure: Any) -> None:
    give(procedure, 0.016, 1e-4)
    procedure.bench.recorder.record(event("energising", instrument="supply"))
    procedure.bench.supply.energised(1.0, 1.0).__enter__()


@pytest.mark.parametrize(
    ("ends", "cause"),
    [
        (lambda _: sys.exit(0), "it tried to end the program, which a procedure must not do: SystemExit"),
        (lambda procedure: give(procedure, float("nan"), 1e-4), "is nan ±"),
        (lambda procedure: give(procedure, float("inf"), 1e-4), "is inf ±"),
        (lambda _: None, "it ended without a figure and without a reason, although it gives stator_resistance"),
        (leave_on, "supply was still on when the procedure ended"),
    ],
)
def test_the_run_fails_with_the_fault_and_everything_off(
    ran: Ran, fakes: dict[Role, Any], ends: Callable[[Any], None], cause: str
) -> None:
    view = ran(ends)
    assert view.status == "failed"
    assert cause in view.as_dict()["cause"]
    assert not view.parameters().parameters
    assert not any(fake.on for fake in fakes.values())


@pytest.mark.parametrize(("value", "cause"), [(-1.0, "out-of-bounds"), (-1e-4, "too-uncertain"), (0.016, "")])
def test_a_figure_whose_whole_interval_is_out_of_bounds_is_withheld(ran: Ran, value: float, cause: str) -> None:
    found = ran(lambda procedure: give(procedure, value, 1e-3)).parameters()
    assert ("stator_resistance" in found.parameters) is (not cause)
    assert [reason.cause for reason in found.withheld.get("stator_resistance", ())] == ([cause] if cause else [])


@pytest.mark.parametrize(
    ("unit", "reader_unit"), [("A", "µA"), ("mV", "V"), ("N·m/A", "mN·m/A"), ("V·s/rad", "V·ms/rad")]
)
def test_a_unit_for_readers_is_as_large_as_the_parameters_own(unit: str, reader_unit: str) -> None:
    with pytest.raises(ValueError, match=r"parameter own: reader_unit .* is not of the size of"):
        ParameterDefinition("own", "x", unit, text("Own"), reader_unit=reader_unit)
    assert ParameterDefinition("own", "x", "V·s/rad", text("Own"), reader_unit="Wb").reader_unit == "Wb"


@pytest.mark.parametrize(
    ("value", "withheld", "said"), [(1e-9, True, False), (2e-5, False, True), (0.016, False, False), (4e3, False, True)]
)
def test_a_size_that_motors_hardly_have_is_asked_about(ran: Ran, value: float, withheld: bool, said: bool) -> None:
    view = ran(lambda procedure: give(procedure, value, 1e-3 * value))
    found = view.parameters()
    reasons = [reason.cause for reason in found.withheld.get("stator_resistance", ())]
    assert reasons == (["implausible-size"] if withheld else [])
    assert ("unusual-size" in str(view.as_dict())) is said


@pytest.mark.parametrize(("uncertainty", "given"), [(0.3, True), (0.9, False)])
def test_a_figure_whose_interval_is_wider_than_itself_is_withheld(ran: Ran, uncertainty: float, given: bool) -> None:
    found = ran(lambda procedure: give(procedure, 0.5, 0.5 * uncertainty)).parameters()
    assert ("stator_resistance" in found.parameters) is given
    reasons = [reason.cause for reason in found.withheld.get("stator_resistance", ())]
    assert reasons == ([] if given else ["too-uncertain"])
