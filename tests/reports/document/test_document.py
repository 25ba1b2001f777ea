"""What the document holds, whatever it is rendered as."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from drivers.interfaces.text import Text, text
from procedures.core.parameter_set import merge
from procedures.core.result import Notice
from reports.document.compose import compose
from reports.document.model import Document, Facts, Notices, Paragraph, PlotFigure, ReportSection, Signatures, Table
from reports.document.record import JournalEnd, RunRecord, SignOff
from tests.reports.document.conftest import result, total

Run = Callable[..., RunRecord]


def section(document: Document, anchor: str) -> ReportSection:
    (found,) = (s for s in document.sections if s.anchor == anchor)
    return found


def tables(found: ReportSection) -> Iterator[Table]:
    yield from (block for block in found.blocks if isinstance(block, Table))


def cells(table: Table) -> list[list[str]]:
    return [[str(cell) for cell in row.cells] for row in table.rows]


def test_the_parts_in_their_order(run: Run) -> None:
    document = compose(run())
    assert [s.anchor for s in document.sections] == [
        "results", "motor", "bench", "procedures", "dq-inductance-time-constant", "pole-pairs-static", "signatures", "record",
    ]  # fmt: skip
    assert document.subtitle == "LG-400W, 0042"
    assert "efefef" in document.running
    (signatures,) = (b for b in section(document, "signatures").blocks if isinstance(b, Signatures))
    assert len(signatures.lines) == 3


def test_who_has_signed_stands_above_the_lines(run: Run) -> None:
    signed = [
        SignOff("Li", "engineer", "2026-11-21 10:00:00 UTC", "", True, text("I measured this motor")),
        SignOff("Wang", "engineer", "2026-11-20 09:30:05 UTC", "seen", False, Text("–")),
    ]
    found = section(compose(run(signed=signed)), "signatures")
    (table,) = tables(found)
    assert cells(table) == [
        ["Li", "engineer", "2026-11-21 10:00:00 UTC", "I measured this motor", "–", "the run as it stands here"],
        [
            "Wang",
            "engineer",
            "2026-11-20 09:30:05 UTC",
            "–",
            "seen",
            "an earlier state: the run was continued, or changed, after it",
        ],
    ]
    assert isinstance(found.blocks[-1], Signatures)


def test_every_parameter_with_the_notes_figure_beside_it(run: Run) -> None:
    (table, *_) = tables(section(compose(run(truth={"d_axis_inductance": 73e-6})), "results"))
    assert [str(column.title) for column in table.columns][:2] == ["Parameter", "Value"]
    d, q = cells(table)
    assert d[:3] == ["d-axis inductance", "73.00", "µH"]
    assert d[5].count("…") == 1
    assert (d[6], d[7], d[8]) == ("80.30", "73.00", "3.3.1")
    assert (q[0], q[7]) == ("q-axis inductance", "–")


def test_steps_as_the_document_has_them(run: Run) -> None:
    steps, *_ = tables(section(compose(run()), "dq-inductance-time-constant"))
    assert cells(steps) == [
        ["3.3.1-d/1", "Align the rotor to d: A to plus, B and C to minus", "by hand", "49.0", "done"],
        ["3.3.1-d/4", "Switch on and record the current's step response", "", "16.5", "done"],
    ]
    failed, *_ = tables(section(compose(run()), "pole-pairs-static"))
    assert cells(failed)[0][1].endswith(": no mark")
    assert cells(failed)[0][4] == "failed"


def test_what_was_set_and_read(run: Run) -> None:
    _, readings, *_ = tables(section(compose(run()), "dq-inductance-time-constant"))
    assert cells(readings) == [
        ["3.3.1-d/4", "DC supply", "voltage, set", "5", "79 mV"],
        ["3.3.1-d/4", "Oscilloscope", "current", "9", "0 … 8 A"],
    ]


def test_budgets_sum_to_what_is_stated(run: Run) -> None:
    found = section(compose(run()), "dq-inductance-time-constant")
    budgets = [t for t in tables(found) if t.title is not None]
    assert len(budgets) == 2
    for table, parameter in zip(budgets, result().parameters, strict=True):
        *rows, last = table.rows
        assert last.total
        assert len(rows) == len(parameter.budget)
        assert total(parameter) == pytest.approx(parameter.standard_uncertainty)
        assert float(str(last.cells[5])) == pytest.approx(1e6 * parameter.standard_uncertainty, rel=0.06)
        assert sum(float(str(row.cells[6]).strip("% <")) for row in rows) == pytest.approx(100.0, abs=2.0)


def test_a_budget_in_another_unit_is_named_only(run: Run) -> None:
    from dataclasses import replace

    found = result()
    first = found.parameters[0]
    again = replace(
        first,
        name="flux_linkage",
        value=2.0 * first.value,
        standard_uncertainty=2.0 * first.standard_uncertainty,
        budget=tuple(replace(row, contribution=2.0 * row.contribution) for row in first.budget),
    )
    procedure = replace(run().procedures[0], result=replace(found, parameters=(first, again)))
    blocks = section(compose(run(procedures=[procedure])), "dq-inductance-time-constant").blocks
    said = [str(block.words) for block in blocks if isinstance(block, Paragraph)]
    assert "Flux linkage: the budget of d-axis inductance in another unit." in said


def test_settings_estimators_plots_and_errata(run: Run) -> None:
    found = section(compose(run()), "dq-inductance-time-constant")
    (settings,) = (block for block in found.blocks if isinstance(block, Facts))
    assert str(settings.items[0][1]) == "repeats: 4; curve_shares: 0.5, 1; polarity: against"
    (figure,) = (block for block in found.blocks if isinstance(block, PlotFigure))
    # The q axis has no record among the steps: its fit is drawn, its voltage is not.
    assert [len(row) for row in figure.plot.rows] == [1, 2, 2]
    (notices,) = (block for block in found.blocks if isinstance(block, Notices))
    assert notices.items[0][0] == "E10"
    results = [t for t in tables(found) if str(t.columns[-1].title) == "Estimator and convention"]
    assert "output-error fit of R, L and offsets to recorded voltage and current; per phase" in cells(results[0])[0][-1]


def test_alarms_and_a_run_that_failed_stand_in_front(run: Run) -> None:
    first, second, *_ = section(compose(run()), "results").blocks
    assert isinstance(first, Notices)
    assert first.grave
    assert "The run failed: pole-pairs-static: no stable position was marked" in str(first.items[0][1])
    assert isinstance(second, Notices)
    assert second.items[0][0] == "consistency-inductance"
    own = [b for b in section(compose(run()), "pole-pairs-static").blocks if isinstance(b, Notices)]
    assert "The procedure failed: no stable position was marked" in str(own[0].items[0][1])


def test_overdue_calibrations_are_flagged(run: Run) -> None:
    bench = section(compose(run()), "bench")
    (instruments,) = tables(bench)
    assert cells(instruments)[0][-1] == "2026-01-01, overdue"
    assert cells(instruments)[1][3] == "none entered"
    assert instruments.rows[1].faint
    (flag,) = (block for block in bench.blocks if isinstance(block, Notices))
    assert "DC supply was overdue" in str(flag.items[0][1])


def test_the_record_says_how_it_is_proven(run: Run) -> None:
    document = compose(run(journal=JournalEnd(42, "ef" * 32, True)))
    blocks = section(document, "record").blocks
    (code,) = (block for block in blocks if isinstance(block, Paragraph) and block.code)
    assert code.words == f"motorbench results verify 20261121T000000Z-lg-400w --sha256 {'ef' * 32}"
    assert any("incomplete" in str(item[1]) for block in blocks if isinstance(block, Notices) for item in block.items)


def test_a_run_without_anything(run: Run) -> None:
    document = compose(
        run(procedures=[], parameters=merge([]), warnings=[], status="interrupted", cause="", instruments=[])
    )
    said: list[Any] = [block.words for block in section(document, "results").blocks if isinstance(block, Paragraph)]
    assert [str(words) for words in said] == ["No parameter was measured."]


def test_warnings_known_before_stand_with_their_procedure(run: Run) -> None:
    warnings = [("inertia", Notice("cannot-support", text("done")))]
    *_, table = tables(section(compose(run(warnings=warnings)), "results"))
    assert cells(table) == [["cannot-support", "inertia", "done"]]
