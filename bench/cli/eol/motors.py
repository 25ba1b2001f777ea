"""`motorbench eol motors`: the motors behind a figure, a bin, a failure, and where their runs are."""

import math
import sys
from dataclasses import asdict
from typing import Annotated, Any

from cyclopts import Parameter

from bench.cli.eol.narrowing_options import ALL_RECORDS, NarrowingOptions, tell_joined
from bench.cli.options import Json, Language, RecordsAddress
from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from drivers.interfaces.text import Text, text

_NONE = text("no motor of the records is as wanted")
_ALL_PASSED = text(
    "every motor of these records passed: without --parameter, --failed and --serial only those that did not are listed. --parameter NAME "
    "lists motors by a figure, --serial NUMBER the tests of one"
)


def motors(
    *batches: str,
    records: RecordsAddress = "records.sqlite",
    model: str = "",
    parameter: str = "",
    low: Annotated[float | None, Parameter(name=("--from", "--low"))] = None,
    high: Annotated[float | None, Parameter(name=("--to", "--high"))] = None,
    failed: str | None = None,
    serial: tuple[str, ...] = (),
    most: int = 100,
    only: NarrowingOptions = ALL_RECORDS,
    language: Language = "auto",
    json: Json = False,
) -> None:
    """List motors with the folders of their runs: by a parameter's figure, by what they failed at, or by serial number.

    Without --parameter, --failed and --serial: those that did not pass, the latest first.

    Parameters
    ----------
    batches
        Names of the batches. Default: all.
    model
        The motor type, if the records are of several types.
    parameter
        Motors with a figure of this parameter, smallest first. With --from and --to, those of one bin of its histogram.
    low
        Least figure, in the parameter's SI unit.
    high
        Greatest figure, in the parameter's SI unit.
    failed
        Motors that failed at this parameter or procedure, latest first.
    serial
        All tests of these motors, in any batch.
    most
        How many are listed.

    """
    if serial and only != ALL_RECORDS:
        raise UsageError(text("--serial lists all tests of a motor; leave --station, --since, --until and --runs away"))
    asked = [name for name, given in (("--parameter", parameter), ("--failed", failed), ("--serial", serial)) if given]
    if len(asked) > 1:
        raise UsageError(text("{names} select different motors; give only one of them", names=" ".join(asked)))
    if not parameter and (low is not None or high is not None):
        raise UsageError(text("--from and --to go with --parameter"))
    if not (-math.inf if low is None else low) <= (math.inf if high is None else high):
        raise UsageError(text("--from {low} --to {high}: no figure lies there", low=low, high=high))
    if not 1 <= most <= 100_000:
        raise UsageError(text("--most {most}: 1 to 100000 is allowed", most=most))
    from bench.eol.line_statistics import StatisticsRequest, known_names
    from bench.eol.narrowing import joined_names
    from bench.eol.store.database import open_for_reading, using
    from bench.eol.store.insertion import settled
    from bench.eol.store.motors import (
        check_measured,
        motors_by_figure,
        motors_by_serial_number,
        motors_not_passed,
    )
    from bench.eol.store.selection import golden_motors

    translate = translator(language_of(language))
    with using(open_for_reading(records)) as engine, settled(engine) as connection:
        if serial:
            found = motors_by_serial_number(connection, serial, most)
        else:
            wanted = StatisticsRequest(batches, model, narrowing=only.read())
            selection = wanted.choose(connection, golden_motors(connection))
            tell_joined(joined_names(connection, batches, selection.narrowed), translate)
            if parameter:
                (name,) = known_names(connection, (parameter,))
                found = motors_by_figure(connection, selection, name, low, high, most)
            else:
                found = motors_not_passed(connection, selection, failed or "", most)
                if failed and not found:
                    check_measured(connection, failed)
    if not found:
        print(f"motorbench: {(_NONE if asked else _ALL_PASSED).render(translate)}", file=sys.stderr)
    if json:
        print_json({"motors": [_plain(asdict(each)) for each in found]})
        return
    from bench.cli.plain_table import plain_table
    from bench.eol.statistics_messages import VERDICTS

    console = console_on(sys.stdout, markup=False)
    heads = [text("Serial number"), text("Batch"), text("Motor"), text("Began (UTC)"), text("Verdict"), Text("")]
    table = plain_table(translate, *heads, left=2)
    for each in found:
        value = "" if each.value is None else f"{each.value:.6g} {each.unit}".rstrip()
        stamp = f"{each.started:%Y-%m-%d %H:%M:%S}"
        verdict = VERDICTS[each.verdict].render(translate)
        table.add_row(each.serial_number, each.batch, str(each.number), stamp, verdict, value)
    console.print(table)
    for each in found:
        # On a line of its own: a path is to be copied whole.
        console.print(f"{each.serial_number}: {each.run or '–'}", soft_wrap=True)


def _plain(motor: dict[str, Any]) -> dict[str, Any]:
    return motor | {"started": motor["started"].isoformat(), "verdict": motor["verdict"].value}
