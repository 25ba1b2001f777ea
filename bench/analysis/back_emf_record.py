"""One record of a back-EMF: its channels, how they are coupled, and its flux linkage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.analysis.applied import AppliedAccuracy
from bench.analysis.line_ends import between_ends
from bench.analysis.outcome import estimated
from bench.analysis.statements import Statement
from bench.analysis.steady_part import steady_part
from bench.captures import Capture, CaptureError, CapturePart, ProbeFactor, read_captures
from bench.captures.capture import same_name
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text
from procedures.estimation.emf.agreement import Combined
from procedures.estimation.emf.back_emf import BackEmfFit, fit_back_emf
from procedures.estimation.emf.coupling import coupling_finding, shortfall
from procedures.estimation.emf.integrated_flux import FluxEstimate, flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.misfit import Misfit

#: Waves whose phases are less apart than this (sine, 3°) are one line's.
_ONE_LINE = 0.05
_COUPLINGS = ("dc", "ac")
#: Orders that are fitted where the sampling tells them; others are asked for.
USUAL_HARMONICS = (1, 3, 5, 7)


@dataclass(frozen=True)
class BackEmfRecord:
    """A capture (V) of one speed with its stated accuracy, and its two estimates."""

    capture: Capture
    applied: AppliedAccuracy
    values: NDArray[np.float64]
    fit: BackEmfFit
    integrated: FluxEstimate

    @property
    def names(self) -> list[str]:
        """The channels' names."""
        return [channel.name for channel in self.capture.channels]

    @property
    def rate(self) -> float:
        """Samples a second."""
        time = self.capture.times()
        return float((time.size - 1) / (time[-1] - time[0]))

    @property
    def speed_changes(self) -> bool:
        """True if the speed drifted or rippled during the record: then the integrated voltage counts."""
        return self.fit.speed_changes

    @property
    def lines(self) -> list[list[str]]:
        """The channels' names, those together that show one wave, or its reverse: they are on one line, or copies of each other."""
        found: list[tuple[float, list[str]]] = []
        for name, phase in zip(self.names, self.fit.phases, strict=True):
            one = next((names for at, names in found if abs(np.sin(phase - at)) < _ONE_LINE), None)
            if one is None:
                found.append((float(phase), [name]))
            else:
                one.append(name)
        return [names for _, names in found]

    @property
    def repeated(self) -> float:
        """By what the uncertainties of a mean over all channels are too small where several are on one line: each counts once."""
        return float(np.sqrt(len(self.names) / len(self.lines)))

    @property
    def flux(self) -> Combined:
        """Flux linkage at the probes (V·s/rad), of the estimator that counts."""
        result = self.integrated.flux_linkage if self.speed_changes else self.fit.flux_linkage
        return replace(result, uncertainty=self.repeated * result.uncertainty, scatter=self.repeated * result.scatter)

    @property
    def shares(self) -> NDArray[np.float64]:
        """The share of each channel in the mean."""
        parts = (
            self.integrated.values
            if self.speed_changes
            else np.abs(self.fit.amplitudes[:, self.fit.harmonics.index(1)])
        )
        return np.asarray(parts / np.sum(parts))

    @property
    def misfit(self) -> Misfit:
        """The record's deviations from the model, and those that its coupling may hide."""
        shown = self.integrated.misfit if self.speed_changes else self.fit.misfit
        open_ = [channel for channel in self.capture.channels if channel.coupling != "dc"]
        said = any(channel.coupling == "ac" for channel in open_)
        found = coupling_finding(self.fit.frequency, [each.name for each in open_], stated=said) if open_ else None
        return Misfit.together((shown, Misfit((found,) if found else ())))

    @property
    def shortfall(self) -> float:
        """By what share the truth may exceed the mean through the coupling of channels that nobody says to be coupled DC."""
        uncoupled = np.array([channel.coupling != "dc" for channel in self.capture.channels])
        return shortfall(self.fit.frequency) * float(np.sum(self.shares[uncoupled]))


def read_record(
    files: Sequence[Path | str],
    *,
    scale: Mapping[str, float | ProbeFactor],
    coupling: Mapping[str, str],
    harmonics: Sequence[int],
    accuracy: Sequence[Statement],
    selection: CapturePart,
    ends: bool = False,
) -> BackEmfRecord:
    """Return one record with its estimates; of two channels' difference where they are the `ends` of one line.

    Raises CaptureError naming file and line.
    """
    capture = _coupled(read_captures(files, selection=selection).evenly_sampled().scaled(scale), coupling)
    for channel in capture.channels:
        if channel.unit not in ("V", ""):
            raise CaptureError(
                capture.source,
                text(
                    "channel {name} is in {unit}; a back-EMF needs voltages only", name=channel.name, unit=channel.unit
                ),
            )
    if ends:
        capture = between_ends(capture)
    part = steady_part(capture.times(), np.vstack([channel.values for channel in capture.channels]))
    if part is not None:
        begin, end, times = part
        capture = CapturePart(begin, end).cut(capture)
        note = text(
            "the speed at its fastest is {times:.3g} times that at its slowest: the longest part in which it hardly changes is evaluated; "
            "--from and --to select another",
            times=times,
        )
        capture = replace(capture, assumptions=(*capture.assumptions, note))
    names = [channel.name for channel in capture.channels]
    applied = AppliedAccuracy(accuracy, {"voltage": names, "time": ("time",)}, (capture,))
    values = np.vstack([channel.values for channel in capture.channels])
    told = [
        DigitizedChannel(c.name, c.resolution, c.clipped, applied.gain("voltage", c.name)) for c in capture.channels
    ]
    time = capture.times()
    fit = estimated(capture, lambda: fit_back_emf(time, values, harmonics=harmonics, digitized=told))
    beyond = sorted({order for order in harmonics if order not in (*fit.harmonics, *USUAL_HARMONICS)})
    if beyond:
        rate = (time.size - 1) / float(time[-1] - time[0])
        raise CaptureError(
            capture.source,
            text(
                "--harmonics {order}: order {order} of {frequency:.4g} Hz lies beyond what {rate:.6g} samples a second tell. "
                "Allowed are orders up to {most}",
                order=beyond[0],
                frequency=fit.frequency,
                rate=rate,
                most=int(0.45 * rate / fit.frequency),
            ),
        )
    integrated = estimated(
        capture,
        lambda: flux_by_integration(time, values, harmonics=harmonics, frequency=fit.frequency, digitized=told),
    )
    return BackEmfRecord(capture, applied, values, fit, integrated)


def read_couplings(words: Sequence[str]) -> dict[str, str]:
    """Return what `--coupling dc|ac` or `--coupling NAME=dc|ac` says, by channel; of all channels under an empty name.

    Raises UsageError naming what was given and what is allowed.
    """
    result: dict[str, str] = {}
    for word in words:
        name, _, coupling = word.rpartition("=")
        if coupling.strip().lower() not in _COUPLINGS:
            raise UsageError(
                text(
                    "--coupling {word}: allowed is dc or ac for all channels, or NAME=dc, NAME=ac for one, as in CH1=ac",
                    word=word,
                )
            )
        said = coupling.strip().lower()
        earlier = next((key for key in result if same_name(key, name)), None)
        if earlier is not None and result[earlier] != said:
            raise UsageError(
                text(
                    "--coupling {word}: {which} stated as {earlier} before; state the coupling of each channel once",
                    word=word,
                    which=name.strip() or "all channels",
                    earlier=result[earlier],
                )
            )
        result[name.strip()] = said
    return result


def _coupled(capture: Capture, coupling: Mapping[str, str]) -> Capture:
    """Return the capture with the couplings stated. Raises CaptureError for a channel that is not there."""
    for name in filter(None, coupling):
        capture.channel(name)
    return replace(
        capture,
        channels=tuple(
            replace(
                channel,
                coupling=next(
                    (said for name, said in coupling.items() if name and same_name(name, channel.name)),
                    coupling.get("", channel.coupling),
                ),
            )
            for channel in capture.channels
        ),
    )
