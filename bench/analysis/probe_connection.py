"""The connection of a back-EMF's probes: as typed, by the channels' names, and contradictions by the record."""

import re
from collections.abc import Iterator, Sequence
from typing import Literal

from bench.analysis.back_emf_record import BackEmfRecord
from bench.analysis.opposite_probes import judge_opposite
from bench.analysis.outcome import AnalysisOutcome
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text
from procedures.estimation.emf.in_phase import in_phase_hum, in_phase_third
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause, Misfit

ProbeConnection = Literal["line", "phase", "neutral", "ends"]
PROBES = {
    "line": text("voltages assumed measured between two lines: phase amplitude = line amplitude / √3"),
    "phase": text("voltages assumed measured from line to an artificial star point"),
    "neutral": text("voltages assumed measured from line to the winding's own star point"),
    "ends": text(
        "two probes on the two ends of one line: its voltage is the difference of the channels; phase amplitude = line amplitude / √3"
    ),
}
#: Names of a motor's three lines.
_LINES = (("a", "b", "c"), ("u", "v", "w"), ("r", "s", "t"), ("l1", "l2", "l3"))
#: What may stand before them.
_BEFORE = ("", "u", "v", "e", "emf", "bemf", "voltage", "phase", "ph", "uphase", "vphase")
#: What names the star point behind them.
_STAR = ("n", "neutral", "star", "0")
#: A third harmonic that is common to all channels, as a share of the fundamental: less may be a converter's.
_FLOOR = 0.005
#: In a channel or two, where windings that differ make some of it: those of a motor with one winding of 80 % make less.
_LONE_FLOOR = 0.03
#: Less asks for a word: a converter's may be so large, and so may a star point's.
_ASKS = 0.0025
#: And beyond noise by so many standard uncertainties.
_CLEAR = 5.0
#: Hum that is common to all channels: of so much of each channel's, and of so much of the fundamental, it is no stray pick-up.
_COMMON, _LARGE = 0.9, 0.05
#: Of less it asks for a word: a differential probe lets some through.
_HUM_ASKS = 0.01
#: What makes a third harmonic in each channel by itself.
_DISTORTS = {Cause.CLIPPED, Cause.DISTORTION, Cause.TOO_COARSE}


def by_name(names: Sequence[str]) -> ProbeConnection | None:
    """Return what the channels' names say of their probes; None where they say nothing.

    Raises UsageError where they are those of phases and leave open against what: √3 hangs on it.
    """
    plain = [re.sub(r"[^a-z0-9]", "", name.lower()) for name in names]
    of_phases = False
    for lines in _LINES:
        pairs = {before + one + other for before in _BEFORE for one in lines for other in lines if one != other}
        phases = {before + one for before in _BEFORE for one in lines}
        to_star = {phase + star for phase in phases for star in _STAR}
        if all(name in to_star for name in plain):
            return "neutral"
        # "UV" is a pair of lines, beside "UU" a phase.
        if all(name in pairs for name in plain) and not (len(plain) < 3 and all(name in phases for name in plain)):
            return "line"
        of_phases = of_phases or all(name in phases for name in plain)
    # A lone channel A is a scope's.
    if of_phases and (len(plain) > 1 or len(plain[0]) > 1):
        raise UsageError(
            text(
                "--connection: the channels are named {names}, like phases. State where the probes were: between "
                "lines (line), to an artificial star point (phase) or to the winding's own star point (neutral). "
                "The flux linkage differs by √3",
                names=list(names),
            )
        )
    return None


def judge_connection(
    outcome: AnalysisOutcome,
    records: Sequence[BackEmfRecord],
    connection: ProbeConnection,
    withheld: Sequence[str],
    *,
    typed: bool,
) -> None:
    """Hold a connection against the third harmonic and the hum of the channels; give none of `withheld` where they cannot be voltages
    between lines, unless somebody `typed` that they are. Where nothing says it, warn of signs that are too small for that.
    """
    judge_opposite(outcome, records, withheld, typed=typed)
    if connection != "line":
        return
    together = all(len(record.lines) >= 3 for record in records)
    if together and not typed and _judge_hum(outcome, records, withheld):
        return
    if _judge_third(outcome, records, withheld, together=together, typed=typed):
        return
    said = Misfit.together(tuple(record.misfit for record in records)).withholding(withheld[0])
    if together and not typed and said is None and by_name(records[0].names) is None:
        _ask(outcome, records, withheld)


def _ask(outcome: AnalysisOutcome, records: Sequence[BackEmfRecord], withheld: Sequence[str]) -> None:
    """Give none of `withheld` for three channels of which nobody said where they were: √3 hangs on it, and no wave tells it."""
    why = text(
        "nothing says where the three probes were. Probes whose grounds are joined, as an oscilloscope's are, measure against a star "
        "point: --connection phase, or neutral where the grounds are on the winding's own. Isolated probes between two terminals each: "
        "--connection line. The flux linkage differs by √3"
    )
    thirds = [] if _distorted(records) else [_third(record, record.values) for record in records]
    if thirds and all(share > _ASKS and share > _CLEAR * noise for share, noise in thirds):
        why = text(
            "nothing says where the three probes were, and they have a common third harmonic of {share:.2%} of the fundamental. A "
            "converter may make it, or they are phase voltages against the winding's own star point. Give --connection line, phase or "
            "neutral; the flux linkage differs by √3",
            share=max(share for share, _ in thirds),
        )
    for record in records:
        for frequency, common, least in _hums(record):
            if common > _HUM_ASKS and common > _COMMON * least:
                why = text(
                    "nothing says where the three probes were, and they have the same hum of {frequency:.0f} Hz, {share:.1%} of the "
                    "fundamental, as voltages of the lines against ground have. Give --connection phase or line; the flux linkage differs "
                    "by √3",
                    frequency=frequency,
                    share=common,
                )
    outcome.withhold(withheld, "connection-open", why)


def _distorted(records: Sequence[BackEmfRecord]) -> bool:
    return any(finding.cause in _DISTORTS for record in records for finding in record.misfit.findings)


def _third(record: BackEmfRecord, values: FloatArray) -> tuple[float, float]:
    return in_phase_third(record.capture.times(), values, record.fit.model)


def _hums(record: BackEmfRecord) -> Iterator[tuple[float, float, float]]:
    """Give the frequency (Hz) of a record's hum, if any, its common part and that of the channel with the least."""
    found = [float(f.figures["frequency"]) for f in record.misfit.findings if f.cause is Cause.HUM]
    for frequency in found[:1]:
        yield (frequency, *in_phase_hum(record.capture.times(), record.values, record.fit.model, frequency))


def _judge_third(
    outcome: AnalysisOutcome,
    records: Sequence[BackEmfRecord],
    withheld: Sequence[str],
    *,
    together: bool,
    typed: bool,
) -> bool:
    """Tell whether a third harmonic contradicts voltages between lines, and give none of `withheld` then unless `typed`."""
    if _distorted(records):
        return False
    shares = []
    for record in records:
        sets = (record.values,) if together else record.values[:, None]
        for values in sets:
            share, u_share = _third(record, values)
            if share < (_FLOOR if together else _LONE_FLOOR) or share < _CLEAR * u_share:
                return False
            shares.append(share)
    if together:
        why = text(
            "the three channels have a common third harmonic of {share:.2%} of the fundamental. Three line voltages "
            "cannot have one; phase voltages against the winding's own star point do. Give --connection neutral, or "
            "--connection line if the probes distort; the flux linkage differs by √3",
            share=max(shares),
        )
    else:
        why = text(
            "a third harmonic of {share:.2%} of the fundamental. Voltages between lines hardly have one; phase voltages "
            "against the winding's own star point do. State where the probe was: --connection neutral or --connection "
            "line; the flux linkage differs by √3",
            share=max(shares),
        )
    if typed:
        outcome.warn(why, "probe-connection")
    else:
        outcome.withhold(withheld, "probe-connection", why)
    return True


def _judge_hum(outcome: AnalysisOutcome, records: Sequence[BackEmfRecord], withheld: Sequence[str]) -> bool:
    """Tell whether three channels have the same hum, and give none of `withheld` then: voltages between lines add up to nothing."""
    for record in records:
        for frequency, common, least in _hums(record):
            if common > _LARGE and common > _COMMON * least:
                outcome.withhold(
                    withheld,
                    "probe-connection",
                    text(
                        "the three channels have the same hum of {frequency:.0f} Hz, {share:.0%} of the fundamental. Three line voltages "
                        "cannot have that, voltages of the lines against ground do. State where the probes were: --connection phase or "
                        "--connection line; the flux linkage differs by √3",
                        frequency=frequency,
                        share=common,
                    ),
                )
                return True
    return False
