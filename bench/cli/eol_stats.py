"""`motorbench eol stats`: what a line's records say of the motors, of the process and of the station."""

from typing import Annotated, Literal

from cyclopts import Parameter

from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text

_RULES = range(1, 9)


def stats(
    *batches: str,
    records: str = "records.sqlite",
    parameter: tuple[str, ...] = (),
    model: str = "",
    golden: tuple[str, ...] = (),
    gauge: Literal["person", "socket"] | None = None,
    alpha: float = 0.05,
    last: int = 100,
    rule: Annotated[tuple[int, ...], Parameter(consume_multiple=True)] = (1, 2, 3, 5, 6),
    confidence: float = 0.95,
    json: bool = False,
    language: str = "auto",
) -> int:
    """Show yields, failures, capability and control charts of batches, of all where none is named.

    Parameters
    ----------
    batches
        The batches' names.
    records
        The records: a SQLite file, or postgresql://USER@HOST/NAME.
    parameter
        Only these parameters, with histogram and chart.
    model
        The type, where the records are of several.
    golden
        Serial numbers of golden motors: left out of all else, and their drift shown.
    gauge
        The batches are a gauge study: its appraisers are the persons, or the sockets; part is the serial number.
    alpha
        In a gauge study, the interaction of part and appraiser is pooled where its p is above this.
    last
        How many of the latest motors the control chart shows.
    rule
        Nelson's rules that the chart looks for, 1 to 8.
    confidence
        Of all intervals.
    json
        Print one JSON object and nothing else.
    language
        en, zh, or auto by the locale.

    """
    if not 0.0 < alpha < 1.0 or not 0.5 <= confidence < 1.0:
        raise UsageError(text("--alpha lies between 0 and 1, --confidence from 0.5 to below 1"))
    if not 2 <= last <= 10_000:
        raise UsageError(text("--last {last}: 2 to 10000 is allowed", last=last))
    if not set(rule) <= set(_RULES):
        raise UsageError(text("--rule {names}: Nelson's rules are 1 to 8", names=" ".join(map(str, rule))))
    from bench.cli.eol_stats_json import gauge_as_dict, statistics_as_dict
    from bench.cli.eol_stats_output import print_gauge, print_statistics
    from bench.eol.line_statistics import StatisticsRequest, gauge_studies, line_statistics, parameter_labels
    from bench.eol.store.database import open_database

    translate = translator(language_of(language))
    wanted = StatisticsRequest(batches, model, parameter, golden, last, tuple(dict.fromkeys(rule)), confidence)
    engine = open_database(records, existing=True)
    try:
        if gauge is not None:
            studies = gauge_studies(engine, wanted, gauge, alpha)
            if json:
                print_json(gauge_as_dict(studies))
            else:
                print_gauge(studies, parameter_labels(engine), confidence, translate)
            return 0
        found, labels = line_statistics(engine, wanted), parameter_labels(engine)
    finally:
        engine.dispose()
    if json:
        print_json(statistics_as_dict(found))
    else:
        print_statistics(found, labels, confidence, translate, detailed=bool(parameter))
    return 0
