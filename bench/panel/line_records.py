"""The line's statistics for a page: what can be chosen, what was chosen, and the figures of it."""

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from bench.i18n.errors import InputError
from drivers.interfaces.text import Text, lines, text, text_of
from reports.labels import ParameterLabels

if TYPE_CHECKING:
    from sqlalchemy import Engine

    from bench.eol.line_statistics import LineStatistics
    from bench.eol.store.selection import Selection

#: Instead of a batch's name: all of them.
ALL = ""
_TO_DO = text(
    "Every motor that is tested at the line leaves one: begin a batch on the page Line, or with motorbench eol run PLAN."
)


@dataclass(frozen=True)
class Choice:
    """A reader's selection; `batch` is None for the latest one, `model` and `parameter` are empty for any.

    Yields are grouped `by` one of `bench.eol.yields.GROUPINGS`.
    """

    model: str = ""
    batch: str | None = None
    parameter: str = ""
    golden: tuple[str, ...] = ()
    by: str = "socket"


@dataclass(frozen=True)
class StatisticsView:
    """The available types, the type's batches (the latest first) and parameters, the completed selection, and its statistics.

    `fault` says why there are no statistics, or none of the parameter.
    """

    choice: Choice
    models: tuple[str, ...] = ()
    batches: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    statistics: "LineStatistics | None" = None
    fault: Text | None = None
    #: Whether that is something that went wrong: records that cannot be read, or what was asked for and is not there.
    refused: bool = False
    labels: ParameterLabels = field(default_factory=lambda: ParameterLabels({}))


@dataclass(frozen=True)
class Bar:
    """Motors that a plot's bar stands for: those that failed at something, or whose figure is in [low, high); None has no bound."""

    failed_at: str = ""
    parameter: str = ""
    low: float | None = None
    high: float | None = None


def motors_of_bar(reference: str, selection: "Selection", bar: Bar, most: int) -> list[str] | Text:
    """Return the serial numbers of a bar's motors, each once, or why they cannot be read. Takes its time: not for an event loop."""
    from sqlalchemy.exc import SQLAlchemyError

    from bench.eol.store.database import NoDatabaseError, open_for_reading, using
    from bench.eol.store.motors import motors_by_figure, motors_not_passed

    try:
        with using(open_for_reading(reference)) as engine, engine.connect() as connection:
            if bar.failed_at:
                motors = motors_not_passed(connection, selection, bar.failed_at, most)
            else:
                motors = motors_by_figure(connection, selection, bar.parameter, bar.low, bar.high, most)
    except (NoDatabaseError, InputError, SQLAlchemyError, OSError) as error:
        return text("The records cannot be read: {error}", error=str(error))
    inside = [each for each in motors if bar.high is None or each.value is None or each.value < bar.high]
    return list(dict.fromkeys(each.serial_number for each in inside))


def serial_numbers(words: str) -> tuple[str, ...]:
    """Return the serial numbers that a reader named, with commas or spaces between them."""
    return tuple(dict.fromkeys(re.findall(r"[^\s,;，、；]+", words)))


def read_statistics(reference: str, choice: Choice) -> StatisticsView:
    """Return what a reader chose of the records in a database. Takes its time: not for an event loop."""
    # The database's library takes a second to load, which a panel without a line need not spend.
    from sqlalchemy.exc import SQLAlchemyError

    from bench.eol.store.database import NoDatabaseError, open_for_reading, using

    try:
        with using(open_for_reading(reference)) as engine:
            return _read(engine, choice)
    except NoDatabaseError:
        return StatisticsView(
            choice,
            fault=lines(
                (
                    text("There are no records at {records} yet.", records=reference),
                    _TO_DO,
                    text("Records that are elsewhere: motorbench serve --records FILE, or a database's address."),
                )
            ),
        )
    except (InputError, SQLAlchemyError, OSError) as error:
        # What a database says of itself stays as it is.
        own = getattr(error, "orig", None)
        message = text_of(error) if own is None else " ".join(str(own).split())
        return StatisticsView(choice, fault=text("The records cannot be read: {error}", error=message), refused=True)


def _read(engine: "Engine", choice: Choice) -> StatisticsView:
    from bench.eol.line_statistics import StatisticsRequest, line_statistics, measured_parameters, parameter_labels
    from bench.eol.store.selection import kept_batches
    from bench.eol.yields import GROUPINGS

    with engine.connect() as connection:
        kept = kept_batches(connection)
    if not kept:
        return StatisticsView(choice, fault=lines((text("There are no records yet."), _TO_DO)))
    models = tuple(dict.fromkeys(model for _, model in kept))
    if choice.model and choice.model not in models:
        missing = text("There are no records of the type {name}.", name=choice.model)
        return StatisticsView(choice, models, fault=missing, refused=True)
    # A batch that is named without its type tells the type.
    model = choice.model or next((model for batch, model in kept if batch == choice.batch), models[0])
    batches = tuple(batch for batch, of in kept if of == model)
    batch = batches[0] if choice.batch is None else choice.batch
    choice = replace(choice, model=model, batch=batch)
    if batch != ALL and batch not in batches:
        missing = text("There is no batch {name}.", name=batch)
        return StatisticsView(choice, models, batches, fault=missing, refused=True)
    wanted = StatisticsRequest(
        () if batch == ALL else (batch,),
        model,
        golden=choice.golden,
        by=[each for each in GROUPINGS if each == choice.by],
    )
    parameters = tuple(measured_parameters(engine, wanted))
    fault, refused = None, False
    if choice.parameter and choice.parameter not in parameters:
        fault, refused = text("There are no figures of {parameter} here.", parameter=choice.parameter), True
    elif not parameters:
        fault = text("No figure was measured here.")
    else:
        choice = replace(choice, parameter=choice.parameter or parameters[0])
    # Yields and failures come with any parameter; one keeps the database from summing up all.
    of = choice.parameter if fault is None else next(iter(parameters), "")
    statistics = line_statistics(engine, replace(wanted, parameters=(of,) if of else ()))
    labels = parameter_labels(engine)
    return StatisticsView(choice, models, batches, parameters, statistics, fault, refused=refused, labels=labels)
