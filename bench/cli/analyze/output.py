"""Output of `motorbench analyze`: the table, or one JSON object; the budgets if requested."""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from bench.cli.analyze.speeds import decelerations_table, speeds_table
from bench.cli.output import print_json
from bench.run.console import console_on
from drivers.interfaces.text import Translate, text


def print_analysis(made: Mapping[str, Any], translate: Translate, *, json: bool, budget: bool) -> int:
    """Print what an analysis found and return the exit status: 1 where a figure is withheld.

    `budget` adds a table for every parameter, which JSON holds anyway; the table speaks the language that `translate` gives.
    """
    if json:
        print_json(made)
    else:
        _print_table(made, translate, budget=budget)
    asked = made["details"].get("decelerations", ())
    return 1 if made["withheld"] or any(row["withheld"] for row in asked) else 0


def _print_table(made: Mapping[str, Any], translate: Translate, *, budget: bool) -> None:
    from bench.journal.stored_result import restore_parameter, restore_withheld
    from procedures.core.result import said_of
    from reports.tables.figures import decimals_for, figure, percent, scale_of
    from reports.tables.fitted import FittedColumn, fitted

    columns = [
        FittedColumn(text("Parameter").render(translate), breaks=24),
        FittedColumn(text("Value").render(translate), right=True),
        FittedColumn(text("Unit").render(translate)),
        FittedColumn("u", 2, right=True),
        FittedColumn("u, %", 3, right=True),
        FittedColumn("95 %", right=True),
        FittedColumn("§", 1),
    ]
    parameters = [restore_parameter({"name": name, **entry}) for name, entry in made["parameters"].items()]
    rows = []
    for each in parameters:
        scale = scale_of(each.value, each.reader_unit)
        value, spread = each.value / scale.factor, each.standard_uncertainty / scale.factor
        decimals = decimals_for(spread, value)
        interval = " … ".join(figure(bound / scale.factor, decimals) for bound in each.coverage_interval)
        rows.append(
            (
                *(each.label.render(translate), figure(value, decimals), scale.unit, figure(spread, decimals)),
                *(percent(abs(spread / value)) if value else "–", interval if spread else "–", each.section),
            )
        )
    withheld = {name: restore_withheld({"name": name, **entry}) for name, entry in made["withheld"].items()}
    not_given = text("not given").render(translate)
    rows += [(r.label.render(translate), not_given, "", "–", "–", "–", r.section) for r in withheld.values()]
    console = console_on(sys.stdout)
    console.print(fitted(columns, rows, console.width))
    if speeds := made["details"].get("speeds"):
        console.print(speeds_table(speeds, translate))
    if decelerations := made["details"].get("decelerations"):
        console.print(decelerations_table(decelerations, translate))
    print_sentences(made, translate, [sentence.render(translate) for sentence in said_of(withheld.values())])
    if budget:
        from reports.tables.budget import budgets

        console.print()
        console.print(budgets(parameters, translate, console.width))


def print_sentences(made: Mapping[str, Any], translate: Translate, not_given: Sequence[str] = ()) -> None:
    """Print why figures are not given, what was assumed, and the warnings that this does not say already."""
    console = console_on(sys.stdout)
    told = {(entry["cause"], entry["message"]) for entry in made["withheld"].values()}
    warnings = [w for w in made["warnings"] if (w["id"], w["text"]) not in told]
    for title, lines in (
        (text("Not given"), not_given),
        (text("Assumed"), made["assumptions"]),
        (text("Warnings"), [f"{translate(w['id'])}: {w['text']}" if w["id"] else w["text"] for w in warnings]),
    ):
        if lines:
            console.print(title.render(translate), style="bold")
            for line in lines:
                console.print(f"  {line}", markup=False)
