"""One motor of the line: its tests, what changed since the one before, and the way to their runs."""

import math
from typing import TYPE_CHECKING

from nicegui import run as background
from nicegui import ui

from bench.eol.statistics_messages import VERDICTS, stated_limits
from bench.eol.told_causes import cause_of, diagnosis_of
from bench.panel.motor_records import (
    FigurePair,
    MotorTests,
    changed_circumstances,
    changed_figures,
    motor_address,
    read_motor,
    run_address,
)
from bench.panel.pages.frame import frame
from bench.panel.pages.parts import named, table
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text
from reports.tables.figures import Scale, decimals_for, figure, scale_of

if TYPE_CHECKING:
    from bench.eol.record import MeasuredFigure, MotorRecord


def motor_tests_page(panel: Panel, session: Session, serial_number: str) -> None:
    """Build the page."""
    heading = text("Motor {serial}", serial=serial_number) if serial_number else text("One motor's tests")
    with frame(panel, session, heading, "/statistics") as reader:
        ui.label(reader.say(heading)).classes("text-3xl font-bold mb-2 break-all").props("role=heading aria-level=1")
        _scan(reader)
        if not serial_number:
            return
        fault = ui.label().props("role=alert").classes("text-xl whitespace-pre-line")
        content = ui.element("div").classes("w-full flex flex-col flex-nowrap gap-4")

        async def read() -> None:
            found = await background.io_bound(read_motor, panel.records, serial_number)
            if found is None or content.is_deleted:
                return
            fault.set_text("" if found.fault is None else reader.say(found.fault))
            with content:
                _Tests(panel, reader, found).build()

        ui.timer(0.01, read, once=True)


def _scan(reader: Reader) -> None:
    """Build the field that takes the next motor's serial number."""
    field = ui.input(reader.say(text("Scan a serial number"))).props("outlined autofocus autocomplete=off")

    def go() -> None:
        if serial := str(field.value or "").strip():
            ui.navigate.to(motor_address(serial))

    field.classes("w-full mb-4").on("keydown.enter", go)


class _Tests:
    def __init__(self, panel: Panel, reader: Reader, found: MotorTests) -> None:
        self._panel, self._reader, self._found = panel, reader, found

    def build(self) -> None:
        tests = self._found.tests
        for number, test in enumerate(tests):
            self._test(len(tests) - number, test, tests[number + 1] if number + 1 < len(tests) else None)

    def _test(self, number: int, test: "MotorRecord", before: "MotorRecord | None") -> None:
        say = self._reader.say
        title = say(text("Test {number}: {verdict}", number=number, verdict=VERDICTS[test.verdict]))
        with named(ui.element("section").classes("mb-card w-full"), title) as card:
            card.props["data-test"] = str(number)
            ui.label(title).classes("text-lg font-semibold").props("role=heading aria-level=2")
            started = test.started.astimezone().strftime("%Y-%m-%d %H:%M")
            place = text(
                "{started}, batch {batch}, station {station}, socket {socket}, plan {plan}",
                started=started,
                batch=test.batch,
                station=test.station,
                socket=test.socket,
                plan=test.plan,
            )
            ui.label(say(place)).classes("text-base")
            faults = "\n".join(say(each) for each in diagnosis_of(test))
            for words in (say(cause_of(test)), faults, f"→ {test.rework}" if test.rework else ""):
                if words:
                    ui.label(words).classes("text-base whitespace-pre-line")
            self._run(test)
            if before is not None:
                self._since(before, test)
            elif test.measured:
                head = [text("Parameter"), text("Limits"), text("Value"), text("Verdict")]
                rows = [self._row(each) for each in test.measured]
                table([say(words) for words in head], rows, numeric=frozenset({1, 2}), stacked=True)

    def _run(self, test: "MotorRecord") -> None:
        if not test.run:
            return
        address = run_address(test, self._panel.runs)
        if address is None:
            gone = text("Its run's folder is not among the runs of this panel: {folder}", folder=test.run)
            ui.label(self._reader.say(gone)).classes("text-base break-all")
        else:
            ui.link(self._reader.say(text("Its run: steps, fits, waveforms")), address).classes("mb-link text-base")

    def _since(self, before: "MotorRecord", test: "MotorRecord") -> None:
        say = self._reader.say
        pairs = changed_figures(before, test)
        names = [self._found.labels[pair.parameter] for pair in pairs if pair.beyond]
        if names:
            message = text("Changed since the test before, by more than both uncertainties: {names}", names=names)
        else:
            message = text("No figure changed since the test before by more than both uncertainties.")
        ui.label(say(message)).classes("text-base font-semibold mt-2").props("data-changed")
        for words, was, is_now in changed_circumstances(before, test):
            changed = text("{what}: {before} → {now}", what=words, before=was or "–", now=is_now or "–")
            ui.label(say(changed)).classes("text-base")
        if not pairs:
            return
        head = [text("Parameter"), text("Limits"), text("Before"), text("Now"), text("Change"), text("Verdict")]
        rows = [self._pair(pair) for pair in pairs]
        table([say(words) for words in head], rows, numeric=frozenset({1, 2, 3, 4}), stacked=True)

    def _row(self, each: "MeasuredFigure") -> list[str]:
        scale, digits = _form(each)
        label = self._reader.say(self._found.labels[each.parameter])
        verdict = self._reader.say(_verdict(each))
        return [label, _limits(each, scale, digits), _shown(each, scale, digits), verdict]

    def _pair(self, pair: FigurePair) -> list[str]:
        say = self._reader.say
        newest = pair.now or pair.before
        if newest is None:
            return []
        scale, digits = _form(newest)
        change = "–"
        if pair.difference is not None:
            change = f"{pair.difference / scale.factor:+.{digits}f} {scale.unit}".rstrip().replace("-", "−")
            change = f"⚠ {change}" if pair.beyond else change
        verdict = "–" if pair.now is None else say(_verdicts(pair.before, pair.now))
        both = [_shown(each, scale, digits) for each in (pair.before, pair.now)]
        return [say(self._found.labels[pair.parameter]), _limits(newest, scale, digits), *both, change, verdict]


def _verdicts(before: "MeasuredFigure | None", now: "MeasuredFigure") -> Text:
    if before is None or _verdict(before) == _verdict(now):
        return _verdict(now)
    return Text("{before} → {now}", {"before": _verdict(before), "now": _verdict(now)})


def _verdict(each: "MeasuredFigure") -> Text:
    return VERDICTS[each.verdict] if _limited(each) else Text("–")


def _limits(each: "MeasuredFigure", scale: Scale, digits: int) -> str:
    return f"{stated_limits(each.low, each.high, scale, digits)} {scale.unit}".rstrip() if _limited(each) else "–"


def _limited(each: "MeasuredFigure") -> bool:
    return math.isfinite(each.low) or math.isfinite(each.high)


def _form(each: "MeasuredFigure") -> tuple[Scale, int]:
    """Return in which scale and with how many decimals a figure is shown."""
    # One that was withheld has only its limits.
    known = [value for value in (each.value, each.high, each.low, 0.0) if math.isfinite(value)]
    scale = scale_of(known[0], each.unit)
    return scale, decimals_for(each.expanded / scale.factor, each.value / scale.factor)


def _shown(each: "MeasuredFigure | None", scale: Scale, digits: int) -> str:
    return "–" if each is None else f"{figure(each.value / scale.factor, digits)} {scale.unit}".rstrip()
