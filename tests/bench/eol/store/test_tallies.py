"""What the database sums up, against the same figures summed up here."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from sqlalchemy import Engine

from bench.eol.limits import ParameterLimits
from bench.eol.line_statistics import StatisticsRequest, line_statistics, measured_parameters
from bench.eol.store.distribution import distribution
from bench.eol.store.insertion import settled
from bench.eol.store.selection import choose
from bench.eol.store.tallies import (
    Failures,
    failures_by_parameter,
    failures_by_procedure,
    latest,
    parameters,
    rows_of_neighbours,
)
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError

Put = Callable[..., None]


def test_moments_and_histogram_are_those_of_the_figures(engine: Engine, put: Put) -> None:
    random = np.random.default_rng(3)
    values = [*random.normal(10.1, 0.4, 60).tolist(), 9.0, 11.0, -50.0, 80.0]
    for value in values:
        put(r=value, other=1.0)
    with settled(engine) as connection:
        result = distribution(connection, "r", choose(connection, ()))
        neighbours = rows_of_neighbours(connection, ["r"], choose(connection, ()))["r"]
    assert result is not None
    assert (result.count, result.unit, result.limits) == (64, "Ω", ParameterLimits(9.0, 11.0))
    assert result.mean == pytest.approx(np.mean(values), rel=1e-13)
    assert result.standard_deviation == pytest.approx(np.std(values, ddof=1), rel=1e-12)
    assert (result.least, result.most) == (-50.0, 80.0)
    edges, counts = result.histogram.edges, result.histogram.counts
    assert sum(counts) == 64
    inside = [n for n, edge in enumerate(edges[:-1]) if 9.0 - 1e-9 <= edge < 11.0 - 1e-9]
    assert sum(counts[n] for n in inside) == sum(9.0 <= value <= 11.0 for value in values)
    assert neighbours == [values]


def test_a_small_spread_about_a_large_mean_is_not_lost(engine: Engine, put: Put) -> None:
    values = [1.0e9 + 0.001 * n for n in range(50)]
    for value in values:
        put(limits=(-math.inf, math.inf), r=value)
    with settled(engine) as connection:
        result = distribution(connection, "r", choose(connection, ()))
    assert result is not None
    assert result.standard_deviation == pytest.approx(np.std(values, ddof=1), rel=1e-6)
    assert sum(result.histogram.counts) == 50


def test_a_figure_that_is_none_counts_nowhere(engine: Engine, put: Put) -> None:
    put(r=10.0)
    put(r=math.nan, error=True)
    with settled(engine) as connection:
        selection = choose(connection, ())
        result = distribution(connection, "r", selection)
        assert result is not None
        assert (result.count, sum(result.histogram.counts)) == (1, 1)
        assert math.isnan(result.standard_deviation)
        assert latest(connection, "r", selection, 5) == [("P-0001", 10.0)]
        assert failures_by_parameter(connection, selection) == [Failures("r", 0, 1)]


def test_only_the_batches_that_are_asked_for(engine: Engine, put: Put) -> None:
    for n, batch in enumerate(["A", "B", "A", "B", "C", "C"]):
        put(batch=batch, r=9.5 + 0.1 * n, s=20.0 if n < 2 else 10.0)
    with settled(engine) as connection:
        for batches, values in ((("A",), [9.5, 9.7]), (("B", "C"), [9.6, 9.8, 9.9, 10.0]), (("C",), [9.9, 10.0])):
            selection = choose(connection, batches)
            result = distribution(connection, "r", selection)
            assert result is not None
            assert selection.count == result.count == len(values)
            assert result.mean == pytest.approx(np.mean(values))
            assert [value for _, value in latest(connection, "r", selection, 9)] == values
            assert [v for row in rows_of_neighbours(connection, ["r"], selection)["r"] for v in row] == values
        assert failures_by_parameter(connection, choose(connection, ("A",))) == [Failures("s", 1, 0)]
        assert failures_by_parameter(connection, choose(connection, ("C",))) == []
        # Two attempts at one motor are one motor that failed.
        assert failures_by_procedure(connection, choose(connection, ())) == [Failures("r", 2, 0)]
        assert parameters(connection) == ["r", "s"]


def test_golden_motors_count_in_nothing(engine: Engine, put: Put) -> None:
    put(r=10.0)
    put(serial="GOLD", r=8.0)
    put(r=10.2)
    with settled(engine) as connection:
        selection = choose(connection, (), golden=("GOLD",))
        result = distribution(connection, "r", selection)
        assert result is not None
        assert (selection.count, selection.first_pass, selection.verdicts[Verdict.FAIL]) == (2, 2, 0)
        assert (result.count, result.least) == (2, 10.0)
        assert failures_by_parameter(connection, selection) == []


def test_types_are_not_mixed(engine: Engine, put: Put) -> None:
    put(batch="A", model="big", r=10.0)
    put(batch="A", model="small", r=1.0)
    with settled(engine) as connection:
        with pytest.raises(InputError, match=r"several types: big, small; .*--model"):
            choose(connection, ())
        result = distribution(connection, "r", choose(connection, (), "small"))
        assert result is not None
        assert (result.count, result.mean) == (1, 1.0)
        with pytest.raises(InputError, match="the types are: big, small"):
            choose(connection, (), "huge")
        with pytest.raises(InputError, match="no batch is named 'Z'; the batches are: A"):
            choose(connection, ("Z",))


def test_limits_that_changed_are_noticed(engine: Engine, put: Put) -> None:
    put(limits=(8.0, 12.0), r=10.0)
    put(limits=(9.0, 11.0), r=10.0)
    with settled(engine) as connection:
        result = distribution(connection, "r", choose(connection, ()))
    assert result is not None
    assert (result.limits, result.changed) == (ParameterLimits(9.0, 11.0), True)


def test_nothing_there(engine: Engine) -> None:
    with settled(engine) as connection, pytest.raises(InputError, match="there are no records yet"):
        choose(connection, ())


def test_a_parameter_of_every_nth_motor_is_found(engine: Engine, put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.tallies._NEAR", 3)
    for n in range(20):
        put(r=10.0, **({"rare": 9.0 + 0.1 * n} if n in (4, 8, 12) else {}))
    with settled(engine) as connection:
        selection = choose(connection, ())
        result = distribution(connection, "rare", selection)
        assert result is not None
        assert (result.count, result.least) == (3, pytest.approx(9.4))
        assert [serial for serial, _ in latest(connection, "rare", selection, 2)] == ["P-0009", "P-0013"]


def test_a_parameter_that_was_kept_just_now_is_found(engine: Engine, put: Put) -> None:
    put(r=10.0)
    assert measured_parameters(engine, StatisticsRequest()) == ["r"]
    put(r=10.0, l=10.0)
    assert line_statistics(engine, StatisticsRequest()).parameters.keys() == {"r", "l"}


def test_parameters_without_limits_come_last_and_those_that_failed_first(engine: Engine, put: Put) -> None:
    # By name the one without limits would be the first.
    put(limits=(-math.inf, math.inf), a=10.0)
    put(b=10.0, c=12.0)
    assert measured_parameters(engine, StatisticsRequest()) == ["c", "b", "a"]
