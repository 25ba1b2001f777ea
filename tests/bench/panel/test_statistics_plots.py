"""Plots of a line's statistics: their lines stand where their figures are."""

import math
from pathlib import Path

import pytest

from bench.eol.line_statistics import StatisticsRequest, line_statistics, parameter_labels
from bench.eol.record import MeasuredFigure
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from bench.i18n.language import translator
from bench.panel.statistics_plots import control_plot, histogram_plot
from tests.bench.eol.motor_records import motor_record

VALUES = (0.006, 0.046, 0.067, 0.053, 0.018, 0.026, 0.02, 0.051)


def test_lines_of_small_figures_are_not_rounded(tmp_path: Path) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    records = Records(engine)
    for number, value in enumerate(VALUES, 1):
        figure = MeasuredFigure("back_emf_unbalance", value, "%", 1e-3, 2e-3, -math.inf, 0.125, Verdict.PASS)
        records.save(motor_record(number, verdict=Verdict.PASS, first_pass=True, measured=(figure,)))
    found = line_statistics(engine, StatisticsRequest()).parameters["back_emf_unbalance"]
    label = parameter_labels(engine)["back_emf_unbalance"]
    lines = control_plot(found, label, translator("en"))["series"][0]["markLine"]
    # The library rounds to so many decimals where this is not negative, to two where it is not given.
    assert lines["precision"] < 0
    names = [mark["name"] for mark in lines["data"]]
    assert [name.split()[0] for name in names] == ["Centre", "UCL"]
    assert lines["data"][0]["yAxis"] == pytest.approx(sum(VALUES) / len(VALUES))
    limits = histogram_plot(found, label, translator("en"))["series"][0]["markLine"]
    assert (limits["precision"] < 0, limits["data"][0]["xAxis"]) == (True, 0.125)
    engine.dispose()
