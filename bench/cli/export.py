"""`motorbench export`: a run's parameters as a controller's file."""

import math
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import Parameter

from bench.cli.new_file import write_new
from bench.cli.options import Runs
from bench.cli.output import broken_of, print_catalogue, print_json, say_broken
from bench.cli.standard_streams import standard_bytes
from bench.i18n.errors import InputError, UsageError, at
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Translate, text

if TYPE_CHECKING:
    from bench.journal.finished_run import FinishedRun
    from bench.plugins.catalogue import Origin
    from reports.exports.target import Sheet, Target

T = TypeVar("T")

#: No current loop is faster (Hz).
_FASTEST = 20_000.0


def export(
    run: str = "",
    *,
    for_: Annotated[str, Parameter(name="--for")] = "",
    list_: Annotated[bool, Parameter(name="--list")] = False,
    station: str = "virtual",
    output: Path | None = None,
    force: bool = False,
    largest_uncertainty: float | None = None,
    bandwidth: float | None = None,
    loop_rate: float | None = None,
    as_detected: bool = False,
    json: bool = False,
    language: str = "auto",
    runs: Runs = Path("runs"),
) -> int:
    """Write a run's parameters in a controller's names, units and conventions.

    Refused, with the reasons, where a needed parameter is missing or too little is known of it.

    Parameters
    ----------
    run
        The run's folder, or its name under `--runs`.
    for_
        A target by its name, as --list gives them:
        vesc, odrive (firmware 0.5), odrive-0.6, simplefoc, moteus, ti, st, mathworks, motulator, gym-electric-motor, json, csv, c-header,
        mdf4 (the waveforms, to a file), or of a flux map: motulator-map, mathworks-lut, c-tables or flux-map-csv.
    list_
        List the targets and where each comes from.
    station
        With --list: a station file. Its plug-ins are listed too.
    output
        File to write. Without it, the content goes to standard output. An existing file with other content is not overwritten.
    force
        Overwrite that file.
    largest_uncertainty
        Largest relative standard uncertainty at which a parameter is still exported. It replaces the bounds in
        docs/reference/exports.md.
    bandwidth
        Bandwidth of the current loop, Hz, for the gains of VESC, ODrive, moteus and SimpleFOC. Default: 159 (1000 rad/s). 0
        writes no gains.
    loop_rate
        Sampling rate of the current loop, Hz. With it, the gains allow for the loop's delay of one and a half samples, so that
        the loop has the bandwidth asked for. Without it, the gains are those of a loop without delay, and the real loop is
        faster. --bandwidth may be up to a fifteenth of this rate.
    as_detected
        Write inductances as the controller's own detection stores them. VESC stores 0.9 of the measured value, and its HFI
        relies on that.
    json
        Print one JSON object and nothing else: the fields with unit, uncertainty and convention, and the content where no file is written.
    language
        Language of reasons and warnings: en, zh, or auto (by the locale). The exported file itself is in English.

    """
    from bench.journal.finished_run import read_run
    from bench.plugins.files import catalogues_of_run
    from bench.report.exporting import subject_of
    from reports.exports.checks import ExportRefusedError, UncertaintyBounds
    from reports.exports.current_loop import DEFAULT_BANDWIDTH, LARGEST_SHARE
    from reports.exports.target import sheet_for

    if list_:
        return _list(station, translator(language_of(language)), json=json)
    if not run or not for_:
        raise UsageError(text("name a run and a target: motorbench export RUN --for TARGET; --list lists the targets"))
    if largest_uncertainty is not None and not 0.0 < largest_uncertainty <= 1.0:
        raise UsageError(
            text(
                "--largest-uncertainty {largest_uncertainty:g}: a number above 0 and up to 1 is allowed",
                largest_uncertainty=largest_uncertainty,
            )
        )
    if bandwidth is not None and not 0.0 <= bandwidth <= _FASTEST:
        raise UsageError(
            text(
                "--bandwidth {bandwidth:g}: a frequency of the current loop from 0 (no gains) to {most:g} Hz is allowed",
                bandwidth=bandwidth,
                most=_FASTEST,
            )
        )
    asked = DEFAULT_BANDWIDTH if bandwidth is None else bandwidth
    if loop_rate is not None and not max(asked, 1.0) <= LARGEST_SHARE * loop_rate < math.inf:
        raise UsageError(
            text(
                "--loop-rate {loop_rate:g}: a current loop of {bandwidth:.4g} Hz needs at least {least:.6g} "
                "samples a second, otherwise its delay makes it overshoot; lower --bandwidth, or leave "
                "--loop-rate out",
                loop_rate=loop_rate,
                bandwidth=asked,
                least=max(asked, 1.0) / LARGEST_SHARE,
            )
        )
    translate = translator(language_of(language))
    read = read_run(run, runs)
    exports = catalogues_of_run(read.start.software).exports
    target = exports.need(for_, lambda why: UsageError(at(f"--for {for_}", why)))
    if target.write_records is not None and output is None and (json or sys.stdout.isatty()):
        raise UsageError(
            text(
                "--for {name}: the file is binary, so it must go to a file; give --output FILE{suffix}",
                name=target.name,
                suffix=target.suffix,
            )
        )
    if as_detected and not target.as_detected:
        raise UsageError(
            text(
                "--as-detected: {title} stores the detected values unchanged; leave the option out, or choose vesc",
                title=target.title,
            )
        )
    subject = subject_of(read)
    strange = _code_of(target, exports.origin(for_))
    try:
        with strange():
            sheet = sheet_for(
                target,
                subject,
                UncertaintyBounds(largest_uncertainty),
                bandwidth=asked,
                loop_rate=loop_rate,
                as_detected=as_detected,
            )
    except ExportRefusedError as refused:
        reasons = "\n".join(f"  {reason.render(translate)}" for reason in refused.reasons)
        raise InputError(
            text(
                "{path} cannot be exported for {title}:\n{reasons}",
                path=read.folder.path,
                title=target.title,
                reasons=reasons,
            )
        ) from None
    with strange():
        content = _of_kind(str, target.write(sheet), "write")
    file = _file_content(target, content, read, strange)
    if output is not None:
        write_new(output, file, force=force)
    for reason in sheet.left_out:
        print(f"motorbench: left out: {reason.render(translate)}", file=sys.stderr)
    for notice in sheet.subject.warnings:
        print(f"motorbench: {notice.identifier}: {notice.message.render(translate)}", file=sys.stderr)
    if json:
        print_json(_as_dict(target, sheet, content, output))
    elif output is None and isinstance(file, bytes):
        with standard_bytes() as written:
            written.write(file)
        sys.stdout.flush()
    elif output is None:
        sys.stdout.write(content)
        sys.stdout.flush()
    return 0


def _code_of(target: "Target", origin: "Origin") -> Callable[[], AbstractContextManager[None]]:
    """Return what a target's code runs in: faults of a plug-in's name it, ours are the program's."""
    from bench.plugins.catalogue import OURS
    from bench.plugins.faults import plugin_code
    from reports.exports.checks import ExportRefusedError

    if origin.name == OURS:
        return nullcontext

    what = text("export target {name}", name=target.name)
    return lambda: plugin_code(what, origin, target.write.__module__, ExportRefusedError)


def _of_kind(kind: type[T], made: object, call: str) -> T:
    if not isinstance(made, kind):
        raise TypeError(
            text("{call} returned {found}, not {wanted}", call=call, found=type(made).__name__, wanted=kind.__name__)
        )
    return made


def _file_content(
    target: "Target", content: str, read: "FinishedRun", strange: Callable[[], AbstractContextManager[None]]
) -> str | bytes:
    from bench.report.exporting import records_of

    if target.write_records is None:
        return content
    records = records_of(read)
    try:
        with strange():
            return _of_kind(bytes, target.write_records(content, read.started, records), "write_records")
    except ModuleNotFoundError as missing:
        raise InputError(
            text(
                "--for {name} needs {module}: install the extra, pip install 'motorbench[{extra}]'",
                name=target.name,
                module=str(missing.name),
                extra="mdf",
            )
        ) from None


def _list(station: str, translate: Translate, *, json: bool) -> int:
    from bench.station.station_file import catalogues_at

    catalogues = catalogues_at(station)
    exports = catalogues.exports
    broken = broken_of(catalogues, exports)
    if json:
        targets = {
            name: {"title": target.title, "suffix": target.suffix, "from": exports.origin(name).as_dict()}
            for name, target in exports.items()
        }
        print_json({"exports": targets, "broken": [one.as_dict() for one in broken]})
        return 0
    print_catalogue(exports, lambda name: exports[name].title)
    say_broken(broken, translate)
    return 0


def _as_dict(target: "Target", sheet: "Sheet", content: str, output: Path | None) -> dict[str, Any]:
    result: dict[str, Any] = {
        "target": target.name,
        "title": target.title,
        "run": sheet.subject.run,
        "fields": {line.name: line.as_dict() for line in sheet.lines},
        "left_out": [str(reason) for reason in sheet.left_out],
        "warnings": [notice.as_dict() for notice in sheet.subject.warnings],
    }
    return result | ({"content": content} if output is None else {"file": str(output)})
