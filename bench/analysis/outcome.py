"""The result of an analysis, in the shape of `--json`."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from GTC.lib import UncertainReal

from bench.analysis.applied import AppliedAccuracy
from bench.captures import Capture, CaptureChannel, CaptureError, ProbeFactor
from bench.captures.written_digits import FloatArray, last_digit
from drivers.interfaces.text import Text, Translate, english, text, text_of, word
from procedures.core.budget import Uncertainties
from procedures.core.misfit_text import misfit_row, sentence
from procedures.core.parameters import PARAMETERS
from procedures.core.result import Withheld
from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.plausibility.sizes import IMPLAUSIBLE, TOO_UNCERTAIN, UNUSUAL, size_beyond, size_unusual, too_uncertain

_Result = TypeVar("_Result")
#: What rounding to the last digit leaves of a fit is smaller than that of one reading by the root of their number, rarely this much more.
_ROUNDING_OF_A_FIT = 3.0
#: Rounding of so many readings averages out as noise does.
_MANY = 300
#: Of the times alone, not of the readings' sizes; no clock is read with more digits than nine.
_OF_TIMES, _NINTH = frozenset({"electrical_frequency"}), 1e-9
_ROUNDED = text("few digits of the numbers in the file")
#: Half a last digit of more than this share is told.
_COARSE = 0.01
#: A rounding of readings by less (share of the large ones) is not told.
_NOT_TOLD = 1e-5
TYPE_A_ONLY = text(
    "uncertainties are statistical (Type A), except for stated ones. The file does not contain gain and offset "
    "errors of oscilloscope, probes and sensors, so they are not included; state them with --accuracy"
)


class AnalysisOutcome:
    """Collects parameters, assumptions, warnings and details of one analysis, and its inputs' uncertainties; `translate` gives the
    sentences in the reader's language.
    """

    def __init__(
        self, procedure: str, section: str, capture: Capture, accuracy: AppliedAccuracy, translate: Translate = english
    ) -> None:
        self.uncertainties = Uncertainties()
        self._translate = translate
        self._procedure = procedure
        self._section = section
        self._accuracy = accuracy
        used = [channel for channel in capture.channels if channel.name in accuracy.channels]
        self._digits, self._readings, self._coarsest = _digits(used)
        self._rounding = float(np.hypot.reduce([channel.rounding for channel in used], initial=0.0))
        self._parameters: dict[str, dict[str, Any]] = {}
        self._withheld: dict[str, dict[str, Any]] = {}
        self._misfit: list[dict[str, Any]] = []
        said = accuracy.sentences() if accuracy.stated else [TYPE_A_ONLY]
        self._assumptions: list[Text] = [*capture.assumptions, *said, *_few_digits(used)]
        self._warnings: list[tuple[str, Text]] = []
        self._details: dict[str, Any] = {"source": capture.source, "format": capture.description}

    def estimate(self, source: Text | str, fit: Fit, name: str) -> UncertainReal:
        """Return a fit's estimate as a Type A input; `source` is what its row of a budget is called."""
        return self.uncertainties.statistical(source, fit.value(name), fit.uncertainty(name), fit.degrees_of_freedom)

    def with_errors(
        self, quantity: UncertainReal, kind: str, channel: str, *, gain: float = 0.0, offset: float = 0.0
    ) -> UncertainReal:
        """Return the quantity with the stated errors of a channel: it goes with the `gain`-th power of the channel, and with
        `offset` times the channel's offset.
        """
        return self._accuracy.on(self.uncertainties, quantity, kind, channel, gain=gain, offset=offset)

    def parameter(
        self,
        name: str,
        quantity: UncertainReal,
        *,
        estimator: str = "",
        convention: str = "",
        winding: float | None = None,
        misfit: Misfit = NO_MISFIT,
        **more: Any,
    ) -> None:
        """Add a parameter in the table's unit, with uncertainty, 95 % coverage interval and budget.

        `winding` is the value of a delta's winding; `misfit` is what the record shows beyond the model (see `Misfit.of`): it is told, and
        where it says so the parameter is withheld.
        """
        self.tell_misfit(misfit)
        if name in self._withheld:
            return
        reason = misfit.withholding(name)
        if reason is not None:
            self._withheld[name] = Withheld(
                name, self._procedure, self._section, reason.cause.value, sentence(reason)
            ).as_dict(self._translate)
            return
        if name not in _OF_TIMES and self._rounding:
            quantity = quantity * self.uncertainties.limit(_ROUNDED, 1.0, self._rounding)
        quantity = self._with_last_digit(quantity, self._digits["times" if name in _OF_TIMES else "readings"])
        beyond = size_beyond(name, float(quantity.x))
        if beyond is not None:
            self.withhold((name,), IMPLAUSIBLE, beyond_words(name, float(quantity.x), beyond))
            return
        made = self.uncertainties.parameter(
            name,
            PARAMETERS[name].unit,
            quantity,
            procedure=self._procedure,
            section=self._section,
            estimator=estimator,
            convention=convention,
            winding=winding,
        )
        vague = too_uncertain(name, made.value, made.coverage_interval, made.unit)
        if vague is not None:
            self.withhold((name,), TOO_UNCERTAIN, vague)
            return
        unusual = size_unusual(name, float(quantity.x))
        if unusual is not None:
            self.warn(unusual_words(name, float(quantity.x), unusual), UNUSUAL)
        told = made.as_dict()
        for row, input_ in zip(told["budget"], made.budget, strict=True):
            row["source"] = input_.source.render(self._translate)
        self._parameters[name] = {**told, **more}

    def _with_last_digit(self, quantity: UncertainReal, digit: float) -> UncertainReal:
        """Return the quantity, where readings scatter by no more than their last `digit`, with that digit's own error: no noise averages
        it out.
        """
        least = _ROUNDING_OF_A_FIT * digit / np.sqrt(12.0 * self._readings) * abs(float(quantity.x))
        if not quantity.u or self.uncertainties.scatter(quantity) >= least:
            return quantity
        if 0.5 * digit > _COARSE:
            said = text(
                "the numbers of '{name}' are written to {share:.0%} of their size, and scatter by less: half of that is in the "
                "interval, as an error that all share. Write what the meter showed with all its digits, not round set points",
                name=self._coarsest,
                share=digit,
            )
            if ("few-digits", said) not in self._warnings:
                self.warn(said, "few-digits")
        return quantity * self.uncertainties.limit(text("last digit of the record's numbers"), 1.0, 0.5 * digit)

    def withhold(self, names: Iterable[str], cause: str, why: Text) -> None:
        """Give none of these parameters, whatever comes later, and warn of the reason once."""
        self.warn(why, cause)
        for name in names:
            self._withheld[name] = Withheld(name, self._procedure, self._section, cause, why).as_dict(self._translate)

    def assume(self, *sentences: Text) -> None:
        """Say what the file left open and the analysis took for granted."""
        self._assumptions += [sentence for sentence in sentences if sentence not in self._assumptions]

    def warn(self, sentence: Text, erratum: str = "") -> None:
        """Add a warning, with the erratum's id where one applies."""
        self._warnings.append((erratum, sentence))

    def tell_misfit(self, misfit: Misfit) -> None:
        """Add what a record shows beyond its model: a warning once a cause, and a row of `misfit`."""
        for finding in misfit.findings:
            row = misfit_row(finding, self._translate)
            if row in self._misfit:
                continue
            self._misfit.append(row)
            warning = finding.cause.value, sentence(finding)
            if warning not in self._warnings:
                self._warnings.append(warning)

    def detail(self, **details: Any) -> None:
        """Add details by name."""
        self._details.update(details)

    def as_dict(self) -> dict[str, Any]:
        """Return the whole as `--json` prints it."""
        return {
            "parameters": self._parameters,
            "withheld": self._withheld,
            "misfit": self._misfit,
            "assumptions": [each.render(self._translate) for each in self._assumptions],
            "warnings": [{"id": name, "text": said.render(self._translate)} for name, said in self._warnings],
            "details": self._details,
        }


def _digits(channels: Sequence[CaptureChannel]) -> tuple[dict[str, float], int, str]:
    """Return the last digit of the times and of the coarsest channel's readings, as shares, how many readings there are, and that
    channel's name.

    A channel of many readings whose steps are known does not count: the fit has their rounding in its own uncertainty. All times
    together tell the interval between them far better than each is rounded.
    """
    digits, coarsest = {"times": _NINTH, "readings": 0.0}, ""
    for channel in channels:
        size = float(np.sqrt(np.mean(channel.values**2))) if channel.values.size else 0.0
        if size > 0.0 and not (channel.resolution and channel.values.size >= _MANY):
            share = last_digit(channel.values) / size
            if share > digits["readings"]:
                digits["readings"], coarsest = share, channel.name
    return digits, max((channel.values.size for channel in channels), default=1), coarsest


def _few_digits(channels: Sequence[CaptureChannel]) -> list[Text]:
    """Return what is said of the channels whose readings share an error because the file has few digits."""
    return [
        text(
            "the numbers of '{name}' have so few digits that the converter's steps are rounded: up to ±{share:.2g} % of its large "
            "readings, which no averaging reduces. It is in the intervals; a binary export, or a smaller range, avoids it",
            name=channel.name,
            share=100.0 * channel.rounding,
        )
        for channel in channels
        if channel.rounding > _NOT_TOLD
    ]


def beyond_words(name: str, value: float, sizes: tuple[float, float]) -> Text:
    """Return what is said of a parameter whose value (SI) no motor has."""
    return text(
        "{label} would be {value:.3g} {unit}, but motors have {least:.0e} to {most:.0e}: check the units in the "
        "headings, the probes' factors, and --scale",
        label=PARAMETERS[name].label,
        value=value,
        unit=PARAMETERS[name].unit,
        least=sizes[0],
        most=sizes[1],
    )


def unusual_words(name: str, value: float, sizes: tuple[float, float]) -> Text:
    """Return what is said of a parameter whose value (SI) motors on a bench hardly have."""
    return text(
        "{label} is {value:.3g} {unit}, but motors on a bench have {least:g} to {most:g}. Check the units in the "
        "headings, the probes' factors and the values that you typed; no other sign shows a unit that is wrong "
        "by a factor of 1000",
        label=PARAMETERS[name].label,
        value=value,
        unit=PARAMETERS[name].unit,
        least=sizes[0],
        most=sizes[1],
    )


def estimated(capture: Capture, estimate: Callable[[], _Result]) -> _Result:
    """Return the estimate; what prevents it is told with the file's name. Raises CaptureError."""
    try:
        return estimate()
    except EstimationError as error:
        raise CaptureError(capture.source, text_of(error)) from error


def pick(
    capture: Capture, wanted: str | None, units: Iterable[str], what: str, words: Iterable[str] = (), option: str = ""
) -> CaptureChannel:
    """Return the channel of a given name, or the only one with one of these units, or named by one of these words.

    `option` is what names the channel on the command line.

    Raises CaptureError where none or several qualify.
    """
    units = tuple(units)
    if wanted is not None:
        return in_units(capture, capture.channel(wanted), units, what)
    lowered = tuple(words)
    fits = [c for c in capture.channels if c.unit in units] or [
        c for c in capture.channels if any(part in c.name.lower() for part in lowered)
    ]
    if len(fits) != 1:
        there = ", ".join(f"{c.name}{f' ({c.unit})' if c.unit else ''}" for c in fits or capture.channels)
        message = text("none") if not fits else text("several")
        raise CaptureError(
            capture.source,
            text(
                "{found} of the columns could be the {what}: {there}; {way}",
                found=message,
                way=text(
                    "name it with {option}, or write its unit {unit} into the heading", option=option, unit=units[0]
                )
                if option
                else text("write its unit {unit} into the heading", unit=units[0]),
                what=word(what),
                there=there,
            ),
        )
    return in_units(capture, fits[0], units, what)


def refuse_over_range(capture: Capture, channel: CaptureChannel) -> CaptureChannel:
    """Return a channel. Raises CaptureError where readings of it are marked as over range, for an evaluation that cannot leave them out."""
    if channel.clipped:
        raise CaptureError(
            capture.source,
            text(
                "column {name} holds readings that are marked as over range: select a part without them (--from, "
                "--to), or record again in a larger range",
                name=channel.name,
            ),
        )
    return channel


def in_units(capture: Capture, channel: CaptureChannel, units: tuple[str, ...], what: str) -> CaptureChannel:
    """Return a channel. Raises CaptureError where its heading says a unit that is none of these."""
    if channel.unit and channel.unit not in units:
        raise CaptureError(
            capture.source,
            text(
                "column {name} is in {unit}, but the {what} must be in {needed}: correct the heading's unit",
                name=channel.name,
                unit=channel.unit,
                what=word(what),
                needed=units[0],
            ),
        )
    return channel


def open_unit(
    capture: Capture, name: str, what: Text | str, offered: Iterable[str], more: Text | str = ""
) -> CaptureError:
    """Return the error for a column whose unit nobody says, where more than one of those `offered` is usual; `more` is another way out."""
    known = list(offered)
    return CaptureError(
        capture.source,
        text(
            "column '{name}' states no unit, and {what} may be in any of {offered}. Write the unit into the "
            "heading, as in '{name} ({first})'{more}",
            name=name,
            what=word(what) if isinstance(what, str) else what,
            offered=known,
            first=known[0],
            more=more,
        ),
    )


def named(factors: Mapping[str, float | ProbeFactor] | None) -> Mapping[str, float | ProbeFactor]:
    """Return the factors, none where not given."""
    return factors or {}


def refuse_copies(records: Sequence[tuple[str, FloatArray]]) -> None:
    """Raise CaptureError where a record, of a name and its readings, is another once more: it would count twice."""
    for place, (name, values) in enumerate(records):
        for earlier, others in records[:place]:
            if np.array_equal(values, others):
                raise CaptureError(
                    name, text("holds the same readings as {earlier}; give each record once", earlier=earlier)
                )


def paths_of(files: Any) -> list[Path | str]:
    """Return one path or several as a list."""
    return [files] if isinstance(files, str | Path) else list(files)
