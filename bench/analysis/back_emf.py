"""Back-EMF captures: fundamental, harmonics, flux linkage, speed constants (§3.4)."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from GTC.lib import UncertainReal

from bench.analysis.back_emf_details import detail_record, detail_speeds, warn_of_record
from bench.analysis.back_emf_record import USUAL_HARMONICS, BackEmfRecord, read_record
from bench.analysis.outcome import AnalysisOutcome, named, paths_of, refuse_copies
from bench.analysis.probe_connection import PROBES, ProbeConnection, by_name, judge_connection
from bench.analysis.statements import Statement
from bench.analysis.temperature import Temperature
from bench.analysis.time_base import CONFIRMED, judge_frequency, judge_open_time, judge_sampling
from bench.captures import WHOLE, CaptureError, CapturePart, ProbeFactor
from bench.i18n.errors import UsageError
from drivers.interfaces.text import Translate, english, text, text_of
from procedures.estimation.emf.back_emf import BackEmfFit
from procedures.estimation.emf.speed_trend import OverSpeeds, over_records
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.mechanics.pole_pairs import from_frequency
from procedures.techniques.temperature.correction import MAGNET_SPREAD, magnet_factor

#: A speed that many standard uncertainties from the record's contradicts it.
_APART = 3.0
#: A ratio of frequency to speed this near to a whole number is that many pole pairs.
_WHOLE = 0.2
_FLUX = "flux_linkage"
#: What follows from flux linkage and pole pairs.
_MECHANICAL = ("back_emf_constant_mechanical", "torque_constant")
#: By whether the speed drifts.
_ESTIMATORS = {True: "voltage integrated over whole periods", False: "least squares of all channels together"}


def analyze_back_emf(
    files: str | Path | Sequence[str | Path],
    *,
    connection: ProbeConnection | None = None,
    pole_pairs: int | None = None,
    scale: Mapping[str, float | ProbeFactor] | None = None,
    coupling: Mapping[str, str] | None = None,
    speed_rpm: float | None = None,
    speed_uncertainty_rpm: float | None = None,
    speeds: int = 1,
    harmonics: Sequence[int] = USUAL_HARMONICS,
    accuracy: Sequence[Statement] = (),
    temperature: Temperature | None = None,
    selection: CapturePart = WHOLE,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return frequency, fundamental, harmonics, phases, drift and flux linkage of a recorded back-EMF (one or more files).

    `connection` says where the probes were, between lines where it is not given; `scale` multiplies channels, by name; `coupling` says
    "dc" or "ac" by channel, of all under an empty name; with `pole_pairs`, or `speed_rpm` (rpm, mechanical; its uncertainty is taken as
    0.5 % where not given) to find them, mechanical constants are added. `speeds` is at how many speeds the files were recorded, as many
    files each, one record after the other. Under a drifting speed the flux comes from the integrated voltage. `accuracy` states the
    errors of voltages and time base; with `temperature` flux and constants are referred to 25 °C by the magnets' coefficient;
    `selection` is the part of each record to take. `translate` gives sentences in the reader's language. Raises CaptureError naming
    file and line.
    """
    if connection is not None and connection not in PROBES:
        raise CaptureError(
            "connection",
            text(
                "connection '{connection}' is not known; allowed are 'line', 'phase' (artificial star point), 'neutral' and 'ends'",
                connection=connection,
            ),
        )
    if pole_pairs is not None and pole_pairs < 1:
        raise CaptureError("pole_pairs", text("{pole_pairs} is below 1", pole_pairs=pole_pairs))
    records = [
        read_record(
            group,
            scale=named(scale),
            coupling=coupling or {},
            harmonics=harmonics,
            accuracy=accuracy,
            selection=selection,
            ends=connection == "ends",
        )
        for group in _by_speed(paths_of(files), speeds)
    ]
    first = records[0]
    fit = first.fit
    refuse_copies([(record.capture.source, record.values) for record in records])
    typed = connection is not None
    connection = connection or by_name(first.names) or "line"
    # Of a fundamental between two lines a phase has a √3-th (§3.4.2).
    factor = 1.0 / math.sqrt(3.0) if connection in ("line", "ends") else 1.0
    outcome = AnalysisOutcome("back_emf_constant", "3.4", first.capture, first.applied, translate)
    outcome.assume(PROBES[connection])
    hanging = (_FLUX, *(_MECHANICAL if pole_pairs or speed_rpm is not None else ()))
    # Of records at several speeds, one speed confirms none but its own.
    turning = None if pole_pairs is None or speed_rpm is None else pole_pairs * abs(speed_rpm) / 60.0
    for record in records:
        outcome.assume(*record.capture.assumptions)
        outcome.assume(
            *(
                text("channel {name} assumed to be in V", name=each.name)
                for each in record.capture.channels
                if not each.unit
            )
        )
        warn_of_record(outcome, record)
        judge_frequency(outcome, record.fit.frequency, turning, ("electrical_frequency", *hanging))
        judge_sampling(outcome, record.fit.frequency, record.rate, turning, ("electrical_frequency", *hanging))
        if turning is None or abs(record.fit.frequency / turning - 1.0) >= CONFIRMED:
            judge_open_time(
                outcome, record.capture, "frequency", record.fit.frequency, ("electrical_frequency", *hanging)
            )
    judge_connection(outcome, records, connection, hanging, typed=typed)
    pole_pairs = _pole_pairs(outcome, fit, pole_pairs, speed_rpm, speed_uncertainty_rpm)
    over = _over_speeds(records)
    misfit = Misfit.together((*(record.misfit for record in records), over.misfit))
    quantity = _flux_linkage(outcome, records, over, factor)
    if any(first.applied.offset("voltage", name) for name in first.names):
        outcome.assume(
            text("the fit includes the offsets of the voltage channels, so they do not affect the flux linkage")
        )
    if temperature is None:
        outcome.assume(
            text(
                "flux linkage at the temperature of the record. That temperature is not given, so the value is not "
                "referred to 25 °C"
            )
        )
    else:
        known = outcome.uncertainties.limit("magnet temperature", temperature.celsius, temperature.half_width)
        quantity = quantity * magnet_factor(outcome.uncertainties, known, temperature.coefficient)
        outcome.assume(
            text(
                "magnets at {celsius:g} °C ± {half_width:g} K with {coefficient:g} 1/K ± {magnet_spread:.0%}: "
                "flux linkage and values calculated from it are referred to 25 °C; channels and details are as "
                "recorded",
                celsius=temperature.celsius,
                half_width=temperature.half_width,
                coefficient=temperature.coefficient,
                magnet_spread=MAGNET_SPREAD,
            )
        )
        outcome.detail(magnet_temperature=temperature.celsius)
    if len(records) == 1:
        frequency = outcome.uncertainties.statistical(
            "fit of the frequency", fit.frequency, first.repeated * fit.frequency_uncertainty, fit.degrees_of_freedom
        )
        outcome.parameter(
            "electrical_frequency",
            outcome.with_errors(frequency, "time", "time", gain=-1.0),
            estimator="least squares",
        )
    else:
        detail_speeds(outcome, records, over, factor, pole_pairs)
    drifting = any(record.speed_changes for record in records)
    _constants(outcome, quantity, fit, pole_pairs, misfit, drifting=drifting, cold=temperature is not None)
    detail_record(outcome, first.capture, first.values, fit, first.integrated, factor)
    return outcome.as_dict()


def _by_speed(files: Sequence[Path | str], speeds: int) -> list[Sequence[Path | str]]:
    """Return the files of each record. Raises UsageError where they cannot be as many for each speed."""
    if speeds < 1 or len(files) % speeds:
        raise UsageError(
            text(
                "--speeds {speeds}: {count} files cannot be divided equally among so many speeds. Give a number "
                "of speeds that divides the number of files, and give the files of one record next to each other",
                speeds=speeds,
                count=len(files),
            )
        )
    each = len(files) // speeds
    return [files[at : at + each] for at in range(0, len(files), each)]


def _over_speeds(records: Sequence[BackEmfRecord]) -> OverSpeeds:
    """Return the flux linkage at the probes over the records' speeds."""
    if len(records) == 1:
        flux = records[0].flux
        return OverSpeeds(flux.value, flux.uncertainty, flux.degrees_of_freedom, 1.0)
    limits = [record.applied.gain("voltage", name) for record in records for name in record.names]
    frequencies = [record.fit.frequency for record in records]
    return over_records(frequencies, [record.flux for record in records], gain_limit=max(limits))


def _pole_pairs(
    outcome: AnalysisOutcome, fit: BackEmfFit, given: int | None, speed_rpm: float | None, u_speed: float | None
) -> int | None:
    """Return the pole pairs given, or found from the speed, as a parameter where they were found."""
    if speed_rpm is None:
        return given
    if u_speed is None:
        u_speed = 0.005 * abs(speed_rpm)
        outcome.assume(text("speed assumed known to 0.5 %"))
    try:
        count = from_frequency(fit.frequency, speed_rpm, fit.frequency_uncertainty, u_speed)
    except ValueError as error:
        raise CaptureError("speed_rpm", text_of(error)) from error
    outcome.detail(frequency_ratio=count.ratio)
    if given is not None and given != count.pole_pairs and abs(count.ratio - count.pole_pairs) <= _WHOLE:
        outcome.withhold(
            _MECHANICAL,
            "pole-pairs-contradict",
            text(
                "{given} pole pairs were given, but frequency and speed give {ratio:.3f}: the number, or the speed, is wrong (poles for "
                "pole pairs, an electrical speed for a mechanical one). The flux linkage does not depend on them; correct one of the two",
                given=given,
                ratio=count.ratio,
            ),
        )
        return given
    if not count.certain or abs(count.ratio - count.pole_pairs) > _WHOLE:
        spread = 2.0 * u_speed / abs(speed_rpm)
        why = text(
            "frequency and speed give {ratio:.3f} pole pairs, which does not decide between the whole numbers "
            "from {least} to {most}; measure the speed more accurately, or give --pole-pairs",
            ratio=count.ratio,
            least=max(1, math.floor(count.ratio * (1.0 - spread))),
            most=math.ceil(count.ratio * (1.0 + spread)),
        )
        if given is None:
            outcome.withhold(("pole_pairs", *_MECHANICAL), "uncertain-pole-pairs", why)
        else:
            outcome.warn(why)
        return given
    if abs(count.ratio / count.pole_pairs - 1.0) > _APART * u_speed / abs(speed_rpm):
        outcome.warn(
            text(
                "{pairs} pole pairs at {frequency:.5g} Hz mean {found:.5g} rpm, but {given:g} rpm was given. The "
                "constants are calculated from the record's frequency; check the tachometer and the "
                "oscilloscope's time base",
                pairs=count.pole_pairs,
                frequency=fit.frequency,
                found=60.0 * fit.frequency / count.pole_pairs,
                given=speed_rpm,
            )
        )
    if given is None:
        outcome.parameter("pole_pairs", outcome.uncertainties.limit("", count.pole_pairs, 0.0), certain=count.certain)
    return count.pole_pairs


def _flux_linkage(
    outcome: AnalysisOutcome, records: Sequence[BackEmfRecord], over: OverSpeeds, factor: float
) -> UncertainReal:
    """Return the mean flux linkage with the channels' errors; the choice between the two estimators is the drift's."""
    first = records[0]
    integrated, fitted = first.integrated.mean(), first.fit.flux_linkage
    outcome.detail(
        flux_linkage_least_squares={
            "value": factor * fitted.value,
            "standard_uncertainty": factor * fitted.uncertainty,
        },
        flux_linkage_integrated={"value": factor * integrated[0], "standard_uncertainty": factor * integrated[1]},
    )
    source = _ESTIMATORS[first.speed_changes] if len(records) == 1 else text("{count} speeds", count=len(records))
    mean = outcome.uncertainties.statistical(source, over.value, over.uncertainty, over.degrees_of_freedom)
    for name, share in zip(first.names, first.shares, strict=True):
        mean = outcome.with_errors(mean, "voltage", name, gain=float(share))
    most = max(record.shortfall for record in records)
    if most:
        mean = mean * outcome.uncertainties.one_sided("coupling not known to be DC", 1.0, most)
    # Where no figure is given, there is no interval that holds it, and the finding says why.
    if most and not any(record.misfit.withholding("flux_linkage") for record in records):
        outcome.assume(
            text(
                "the coupling of the channels is not stated. AC coupling below 10 Hz would reduce the voltage by "
                "up to {most:.2%}, and the interval includes that; give --coupling dc if the channels were DC "
                "coupled",
                most=most,
            )
        )
    return factor * outcome.with_errors(mean, "time", "time", gain=1.0)


def _constants(
    outcome: AnalysisOutcome,
    flux: UncertainReal,
    fit: BackEmfFit,
    pole_pairs: int | None,
    misfit: Misfit,
    *,
    drifting: bool,
    cold: bool,
) -> None:
    """Add flux linkage and what follows from it."""
    how = _ESTIMATORS[drifting]
    at = ", at 25 °C" if cold else ""
    phase = "peak, per phase of the Y-equivalent"
    about = _FLUX
    outcome.parameter(
        about, flux, estimator=how, convention=f"{phase}, per electrical radian{at}", misfit=misfit.of(about)
    )
    if pole_pairs is None:
        outcome.assume(text("pole pairs not given: the mechanical constants are not calculated"))
        return
    outcome.assume(text("{pole_pairs} pole pairs", pole_pairs=pole_pairs))
    mechanical = {
        "back_emf_constant_mechanical": (pole_pairs, f"{phase}, per mechanical radian{at}"),
        "torque_constant": (1.5 * pole_pairs, f"per peak phase ampere of the Y-equivalent{at}"),
    }
    for name, (times, convention) in mechanical.items():
        outcome.parameter(name, times * flux, estimator=how, convention=convention, misfit=misfit.of(about, name))
    outcome.detail(
        mechanical_speed_rpm=60 * fit.frequency / pole_pairs,
        back_emf_constant_per_krpm={
            "value": float(flux.x) * pole_pairs * 1000 * math.pi / 30,
            "unit": "V/krpm, phase, peak",
        },
    )
    outcome.warn(
        text(
            "flux_linkage is V·s per electrical radian, back_emf_constant_mechanical V·s per mechanical radian: they differ by the "
            "{pole_pairs} pole pairs",
            pole_pairs=pole_pairs,
        ),
        "E4",
    )
