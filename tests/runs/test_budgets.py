"""Every figure of a whole run stands on a budget that comes to what is stated."""

import math
from pathlib import Path

import pytest

from bench.cli.main import main
from bench.journal.journal_file import read_journal
from bench.journal.run_view import view_of
from procedures.core.result import Contribution


@pytest.fixture(scope="module", params=["lg-400w", "outrunner-delta"], ids=["wye", "delta"])
def whole_run(request, motorbench_once):
    """Return what the journal has of every procedure on a virtual motor; the run is that of `test_known_truth.py`."""
    _, given = motorbench_once("demo", "--motor", request.param, "--seed", "7")
    return view_of(read_journal(Path(given["run"]) / "journal.jsonl").events)


def figures(view):
    merged = view.parameters()
    for name, parameter in merged.parameters.items():
        yield from (p for p in (parameter, *merged.alternatives[name]) if p.source == "measured" and p.name == name)


def test_rows_sum_to_the_stated_uncertainty(whole_run):
    checked = 0
    for parameter in figures(whole_run):
        rows = math.hypot(*(row.contribution for row in parameter.budget))
        assert rows == pytest.approx(parameter.standard_uncertainty, rel=1e-6), (parameter.name, parameter.procedure)
        checked += bool(parameter.budget)
    assert checked > 15


def test_each_row_says_where_it_comes_from_and_how_it_reaches_the_result(whole_run):
    for parameter in figures(whole_run):
        for row in parameter.budget:
            assert isinstance(row, Contribution)
            assert row.source
            assert row.kind in ("A", "B")
            assert math.isfinite(row.value)
            assert row.standard_uncertainty > 0.0
            assert abs(row.sensitivity) * row.standard_uncertainty == pytest.approx(row.contribution, rel=1e-9)
        contributions = [row.contribution for row in parameter.budget]
        assert contributions == sorted(contributions, reverse=True)


def test_a_healthy_motor_raises_no_alarm(whole_run):
    assert [n for _, n in whole_run.warnings() if n.identifier.startswith("consistency")] == []


def test_results_print_a_budget(motorbench, tmp_path, capsys):
    _, given = motorbench("run", "stator-resistance", "--station", "virtual", "--motor", "lg-400w")
    with pytest.raises(SystemExit) as stopped:
        main(["results", given["run"], "--budget", "stator_resistance", "--language", "en"])
    assert stopped.value.code == 0
    shown = capsys.readouterr().out
    for part in (
        "Stator resistance (Stator resistance, §3.2.2)",
        "winding temperature",
        "repeats of R_AB",
        "LCR meter",
    ):
        assert part in shown
    with pytest.raises(SystemExit) as stopped:
        main(["results", given["run"], "--budget", "stator_resistence"])
    assert stopped.value.code == 2
    assert "did you mean stator_resistance?" in capsys.readouterr().err
