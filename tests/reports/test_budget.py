import io
import math

import pytest
from rich.console import Console

from drivers.interfaces.text import english, word
from procedures.core.result import Contribution, Parameter
from reports.tables.budget import budgets, combined


def parameter(*rows: Contribution) -> Parameter:
    total = math.hypot(*(row.contribution for row in rows))
    return Parameter(
        "stator_resistance", 0.016, "Ω", total, 12.0, (0.015, 0.017), "stator-resistance", "3.2.2", "e", budget=rows
    )


def shown(made: Parameter) -> str:
    stream = io.StringIO()
    Console(file=stream, width=120).print(budgets([made], english, 120))
    return stream.getvalue()


ROWS = (
    Contribution(word("LCR meter: offset"), 0.0, 0.577, 5.2e-4, 3e-4, "B"),
    Contribution(word("repeats of R_AB"), 0.0322, 4e-4, 1.0, 4e-4, "A"),
    Contribution(word("resolution"), 0.0, 1e-9, 1.0, 1e-9, "B"),
)


def test_a_budget_shows_every_row_and_what_they_come_to() -> None:
    lines = shown(parameter(*ROWS)).splitlines()
    assert combined(parameter(*ROWS)) == pytest.approx(5e-4)
    assert lines[0] == "Stator resistance (stator-resistance, §3.2.2)"
    assert lines[1].startswith(
        "16.00 mΩ, standard uncertainty 0.50, 12 effective degrees of freedom, 95 %: 15.00 … 17.00"
    )
    cells = {line.split("  ")[0].strip(): line.split() for line in lines}
    assert cells["LCR meter: offset"][-6:] == ["0", "0.577", "0.00052", "0.30", "36", "%"]
    assert cells["repeats of R_AB"][-3:] == ["0.40", "64", "%"]
    assert cells["resolution"][-3:] == ["<", "0.01", "%"]
    assert cells["all rows, root sum of squares"][-3:] == ["0.50", "100", "%"]


def test_a_counted_figure_has_none() -> None:
    made = Parameter("pole_pairs", 4.0, "1", 0.0, math.inf, (4.0, 4.0), "p", "3.1", "e")
    assert "It has no uncertainty, and so no budget." in shown(made)
