"""`motorbench parameters`: what can be measured, in which unit and by which convention."""

import sys
from typing import Any

from bench.cli.options import Json, Language
from bench.cli.output import broken_of, print_json, say_broken
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from bench.station.station_file import catalogues_at
from drivers.interfaces.text import Translate, text
from procedures.core.parameter_definition import ParameterDefinition
from procedures.known_parameters import givers, known_parameters
from reports.tables.parameter_reference import page, values


def parameters(
    *, station: str = "virtual", json: Json = False, markdown: bool = False, language: Language = "auto"
) -> None:
    """List the parameters with symbol, unit, convention and the procedures that give them.

    Parameters
    ----------
    station
        A station file. The parameters of its plug-ins are listed too.
    markdown
        Print the page `docs/reference/parameters.md`.

    """
    translate = translator(language_of(language))
    catalogues = catalogues_at(station)
    found = catalogues.procedures
    known, procedures = known_parameters(found), givers(found)
    broken = broken_of(catalogues, found)
    if json:
        given = {name: list(procedures.get(name, ())) for name in known}
        listed = {name: _entry(row, translate) | {"procedures": given[name]} for name, row in known.items()}
        print_json({"parameters": listed, "broken": [one.as_dict() for one in broken]})
        return
    if markdown:
        sys.stdout.write(page(known.values(), procedures, translate))
        return
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    # A name is copied and a unit read as one word: only sentences go over several lines.
    for heading in (text("Parameter"), text("Unit")):
        table.add_column(heading.render(translate), no_wrap=True)
    for heading in (text("Meaning"), text("Convention")):
        table.add_column(heading.render(translate), overflow="fold")
    for name, row in known.items():
        table.add_row(name, row.unit, row.label.render(translate), translate(row.convention) if row.convention else "")
    console_on(sys.stdout).print(table)
    say_broken(broken, translate)


def _entry(row: ParameterDefinition, translate: Translate) -> dict[str, Any]:
    return {
        "symbol": row.symbol,
        "unit": row.unit,
        "label": row.label.render(translate),
        "convention": translate(row.convention) if row.convention else "",
        "values": values(row.bounds),
        "type_value": row.type_value,
    }
