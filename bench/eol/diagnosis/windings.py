"""Faults of leads and windings: what three lines, three phases and their voltages tell of one winding."""

from collections.abc import Iterator, Mapping

from bench.eol.diagnosis.diagnosed import Diagnosis, Evidence, FaultyPart
from drivers.interfaces.text import text

PHASES = ("A", "B", "C")
#: Figures that tell of windings which are not alike.
_UNLIKE = {
    "resistance_unbalance",
    "inductance_unbalance",
    "back_emf_unbalance",
    "back_emf_angle_deviation",
    "stator_resistance",
}
#: One winding's resistance differs from the others' by this (relative) where it is at fault, and not all three.
_ODD = 0.025
#: A pattern of three deviations is one winding's where the other pattern is less than this share of it.
_CLEAR = 0.5
#: Inductances of two lines that share a winding lie this (relative) below the third: turns that are only missing do not do that.
_SHORTED = 0.1


def lead_faults(evidence: Evidence) -> Iterator[Diagnosis]:
    """Give what connections that are not as told say of a lead: it is off or its phase broken, or two are exchanged."""
    exchanged = [m for m in evidence.mistakes if m.get("kind") in ("exchanged", "order")]
    broken = sorted({terminal for m in evidence.mistakes if m.get("kind") == "open" for terminal in m["terminals"]})
    if broken and len(broken) < len(PHASES):
        place = "/".join(broken)
        yield Diagnosis(FaultyPart.LEAD, place, text("lead or phase {place} is open", place=place))
    elif exchanged:
        pairs = {tuple(sorted(m.get("terminals", ()))) for m in exchanged}
        place = "/".join(next(iter(pairs))) if len(pairs) == 1 else ""
        if place:
            yield Diagnosis(FaultyPart.LEAD, place, text("leads {place} are exchanged", place=place))
        else:
            # A turned order is the same whichever two they are.
            yield Diagnosis(FaultyPart.LEAD, "", text("two of the leads A, B, C are exchanged"))
    elif evidence.mistakes:
        yield Diagnosis(FaultyPart.LEAD, "", text("a lead is off, or exchanged with another"))


def winding_faults(evidence: Evidence) -> Iterator[Diagnosis]:
    """Give what is wrong with one winding, or with the resistance of all."""
    if not _UNLIKE & evidence.outside.keys():
        return
    resistance, emf = _odd_resistance(evidence), _odd_emf(evidence)
    if resistance is not None and not _explains(evidence, resistance[1]):
        resistance = None
    short = _shorted_by_lines(evidence)
    if short is not None:
        winding, below = short
        yield Diagnosis(
            FaultyPart.SHORT,
            winding,
            text(
                "turns of winding {winding} are shorted: inductance of its two lines {below:.1f} % below the third's",
                winding=winding,
                below=100.0 * below,
            ),
        )
    elif emf is not None and emf[0] is FaultyPart.SHORT:
        yield Diagnosis(
            FaultyPart.SHORT,
            emf[1],
            text(
                "turns of winding {winding} are shorted: the other two phases' back-EMF differs by {share:.1f} %",
                winding=emf[1],
                share=100.0 * emf[2],
            ),
        )
    elif emf is not None:
        yield _missing(emf[1], emf[2], resistance)
    elif resistance is not None and resistance[1] > 0.0:
        yield _joint(evidence, *resistance)
    elif resistance is not None:
        winding, share = resistance
        yield Diagnosis(
            FaultyPart.TURNS,
            winding,
            text("winding {winding}: R {share:+.1f} % against the others", winding=winding, share=100.0 * share),
        )
    elif "stator_resistance" in evidence.outside and "flux_linkage" not in evidence.outside:
        share = evidence.outside["stator_resistance"] - 1.0
        yield Diagnosis(
            FaultyPart.WINDING,
            "",
            text("all three windings: R {share:+.1f} % of the type's, and alike", share=100.0 * share),
        )


def _missing(winding: str, share: float, resistance: tuple[str, float] | None) -> Diagnosis:
    if resistance is not None and resistance[0] == winding and resistance[1] < 0.0:
        words = text(
            "winding {winding} lacks turns: its back-EMF {emf:+.1f} %, its R {share:+.1f} % against the others",
            winding=winding,
            emf=100.0 * share,
            share=100.0 * resistance[1],
        )
    else:
        words = text(
            "winding {winding} lacks turns: its back-EMF {emf:+.1f} % against the others",
            winding=winding,
            emf=100.0 * share,
        )
    return Diagnosis(FaultyPart.TURNS, winding, words)


def _joint(evidence: Evidence, winding: str, share: float) -> Diagnosis:
    lines = evidence.of("winding-balance", "resistance_unbalance_deviations")
    if lines:
        words = text(
            "joint or wire of {winding}: R {share:+.1f} % against the others (lines AB {ab:+.1f} %, BC {bc:+.1f} %, CA {ca:+.1f} %)",
            winding=winding,
            share=100.0 * share,
            ab=lines["AB"],
            bc=lines["BC"],
            ca=lines["CA"],
        )
    else:
        words = text(
            "joint or wire of {winding}: R {share:+.1f} % against the others", winding=winding, share=100.0 * share
        )
    return Diagnosis(FaultyPart.JOINT, winding, words)


def _odd_resistance(evidence: Evidence) -> tuple[str, float] | None:
    """Return the winding whose resistance is the odd one, and by how much relative to the others' mean; four wires count more."""
    found = evidence.of("stator-resistance-dc", "phase_resistances") or evidence.of(
        "winding-balance", "phase_resistances"
    )
    if not found:
        return None
    shares = {phase: _against_others(found, phase) for phase in found}
    winding = max(shares, key=lambda phase: abs(shares[phase]))
    return (winding, shares[winding]) if abs(shares[winding]) > _ODD else None


def _explains(evidence: Evidence, share: float) -> bool:
    """Tell whether one odd winding may be why the figures failed: it moves the mean of three by a third of what it is off."""
    if len(_UNLIKE & evidence.outside.keys()) > 1 or "stator_resistance" not in evidence.outside:
        return True
    return not abs(share) / 3.0 < _CLEAR * abs(evidence.outside["stator_resistance"] - 1.0)


def _odd_emf(evidence: Evidence) -> tuple[FaultyPart, str, float] | None:
    """Return what three phases' voltages against an artificial star point say.

    A winding with less turns has a smaller voltage, by half as much as its share there, and the others are alike. A current in
    shorted turns lags by a quarter of a period: it makes the one neighbour larger and the other smaller.
    """
    # Turned both ways, what lags makes both neighbours alike.
    sizes = evidence.of("back-emf-shape", "flux_linkages_forwards") or evidence.of("back-emf-shape", "flux_linkages")
    if not sizes or not {"back_emf_unbalance", "back_emf_angle_deviation"} & evidence.outside.keys():
        return None
    mean = sum(sizes.values()) / len(sizes)
    off = {phase: size / mean - 1.0 for phase, size in sizes.items()}
    patterns = []
    for phase in off:
        one, other = (off[each] for each in off if each != phase)
        patterns.append((phase, off[phase] - 0.5 * (one + other), abs(one - other)))
    phase, less, unlike = min(patterns, key=lambda pattern: pattern[1])
    if unlike < _CLEAR * -less:
        return FaultyPart.TURNS, phase, 2.0 * less
    phase, apart, unlike = min(patterns, key=lambda pattern: abs(pattern[1]))
    if abs(apart) < _CLEAR * unlike:
        return FaultyPart.SHORT, phase, unlike
    return None


def _shorted_by_lines(evidence: Evidence) -> tuple[str, float] | None:
    lines = evidence.of("winding-balance", "line_inductances")
    if not lines or "inductance_unbalance" not in evidence.outside:
        return None
    largest = max(lines, key=lambda line: lines[line])
    rest = [lines[line] for line in lines if line != largest]
    below = 1.0 - max(rest) / lines[largest]
    winding = next(phase for phase in PHASES if phase not in largest)
    return (winding, 1.0 - sum(rest) / 2.0 / lines[largest]) if below > _SHORTED else None


def _against_others(values: Mapping[str, float], phase: str) -> float:
    others = [value for name, value in values.items() if name != phase]
    return values[phase] * len(others) / sum(others) - 1.0
