"""`motorbench eol stats`: what a line's records say of the motors, of the process and of the station."""

from dataclasses import replace
from typing import Annotated, Literal

from cyclopts import Parameter

from bench.cli.eol.narrowing_options import ALL_RECORDS, NarrowingOptions, tell_joined
from bench.cli.options import Json, Language, RecordsAddress
from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text

#: As `bench.eol.yields` has it, whose libraries a page of help need not load.
Grouping = Literal["station", "socket", "shift", "date", "plan"]
_RULES = range(1, 9)
Study = Literal["crossed", "range", "type-1", "linearity"]


def stats(
    *batches: str,
    records: RecordsAddress = "records.sqlite",
    parameter: tuple[str, ...] = (),
    model: str = "",
    golden: tuple[str, ...] = (),
    by: Annotated[tuple[Grouping, ...], Parameter(consume_multiple=True)] = (),
    shifts: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = ("06:00", "14:00", "22:00"),
    gauge: Literal["person", "socket"] | None = None,
    study: Study | None = None,
    reference: tuple[str, ...] = (),
    alpha: float = 0.05,
    last: int = 100,
    rule: Annotated[tuple[int, ...], Parameter(consume_multiple=True)] = (),
    confidence: float = 0.95,
    only: NarrowingOptions = ALL_RECORDS,
    json: Json = False,
    language: Language = "auto",
) -> int:
    """Show yields, failures, capability and control charts of batches, of all where none is named.

    Parameters
    ----------
    batches
        The batches' names.
    parameter
        Only these parameters, with histogram and chart.
    model
        The motor type, if the records are of several types.
    golden
        Serial numbers of golden motors, in addition to those in the records. They are left out of all other statistics, and
        their drift is shown.
    by
        Also show yields by these. A motor counts where it was first judged.
    shifts
        When shifts begin.
    gauge
        Evaluate the batches as a gauge study, with persons or sockets as appraisers. The part is the serial number.
    study
        Type of gauge study: crossed (analysis of variance), range (every appraiser measures every motor once), type-1 (Cg and
        Cgk from one motor of known value) or linearity (several motors of known value). --golden shows stability.
    reference
        In a type-1 or linearity study: a motor of known value for the one --parameter, as SERIAL=VALUE in its SI unit.
    alpha
        In a gauge study: the interaction of part and appraiser is pooled if its p is above this.
    last
        Number of latest motors in the control chart.
    rule
        Nelson's rules (1 to 8) for the control chart. They replace the default limits, which signal on at most 1 % of charts
        without a change.
    confidence
        Of all intervals.

    """
    if not 0.0 < alpha < 1.0 or not 0.5 <= confidence < 1.0:
        raise UsageError(text("--alpha lies between 0 and 1, --confidence from 0.5 to below 1"))
    if not 2 <= last <= 10_000:
        raise UsageError(text("--last {last}: 2 to 10000 is allowed", last=last))
    if not shifts:
        raise UsageError(text("--shifts: give the times of day at which the shifts begin"))
    if not set(rule) <= set(_RULES):
        raise UsageError(text("--rule {names}: Nelson's rules are 1 to 8", names=" ".join(map(str, rule))))
    from bench.cli.eol.gauge import GaugeRequest, references, show_study
    from bench.eol.line_statistics import StatisticsRequest
    from bench.eol.yields import shift_starts

    wanted = StatisticsRequest(batches, model, parameter, golden, last, tuple(dict.fromkeys(rule)), confidence)
    wanted = replace(wanted, narrowing=only.read(), by=tuple(dict.fromkeys(by)), shifts=shift_starts(shifts))
    translate = translator(language_of(language))
    if gauge is not None or study is not None:
        asked = GaugeRequest(study or "crossed", gauge or "person", references(reference), alpha)
        return show_study(records, wanted, asked, translate, json=json)
    from bench.cli.eol.stats_json import statistics_as_dict
    from bench.cli.eol.stats_output import print_statistics
    from bench.eol.line_statistics import line_statistics, parameter_labels
    from bench.eol.store.database import open_for_reading, using
    from bench.eol.store.selection import check_tested

    with using(open_for_reading(records)) as engine:
        found, labels = line_statistics(engine, wanted), parameter_labels(engine)
        with engine.connect() as connection:
            check_tested(connection, golden)
    tell_joined(found.joined, translate)
    if json:
        print_json(statistics_as_dict(found))
    else:
        print_statistics(found, labels, confidence, translate, detailed=bool(parameter), named_rules=bool(rule))
    return 0
