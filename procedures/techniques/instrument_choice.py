"""The instrument that the note's rules require for a reading, its presence in the station, and the reasons."""

from dataclasses import dataclass
from typing import Any

from drivers.interfaces.text import Text, english, lines, text, word
from procedures.core.bench import Bench, Role

#: Above this reading (Ω) any meter will do for a resistance (§3.2.2); an inductance from this on (H) counts as "tens of mH" (§3.3.2).
RESISTANCE_RULE, INDUCTANCE_RULE = 2.0, 10e-3


@dataclass(frozen=True)
class InstrumentChoice:
    """The instrument chosen for a reading, and the reasons; `procedure` is the one that uses it, `short` is true if the station
    lacks a suitable one, `unstated` if the meter's accuracy is not stated where the rule requires a precision bridge.
    """

    chosen: Text
    procedure: str
    reasons: tuple[Text, ...]
    short: bool
    unstated: bool = False

    def sentence(self) -> Text:
        """Return the choice with its reasons."""
        return text("to be chosen: {chosen}. {reasons}", chosen=self.chosen, reasons=lines(self.reasons, "; "))

    def as_finding(self) -> dict[str, Any]:
        """Return it JSON-ready."""
        return {
            "chosen": self.chosen.render(english),
            "procedure": self.procedure,
            "reasons": [reason.render(english) for reason in self.reasons],
            "station_falls_short": self.short,
        }


def choose_for_resistance(bench: Bench, reading: float | None, share: float | None, wanted: float) -> InstrumentChoice:
    """Choose for a line resistance (Ω), None where it is not known yet.

    `share` is the bench's meter's standard uncertainty over that reading, `wanted` what is asked for.
    """
    direct = bench.has(Role.SUPPLY) and bench.has(Role.VOLTMETER)
    if reading is None:
        rule = text("the resistance is not known yet: a precision bridge is right for every value")
    elif reading > RESISTANCE_RULE:
        rule = text("{value:.3g} Ω between lines is above 2 Ω: a hand-held RLC meter will do", value=reading)
    else:
        rule = text("{value:.3g} Ω between lines is below 2 Ω: a precision bridge is needed", value=reading)
    return _choice(
        bench,
        rule,
        small=reading is None or reading <= RESISTANCE_RULE,
        reading_known=reading is not None,
        share=share,
        wanted=wanted,
        here="stator-resistance",
        instead=(text("four-wire direct current"), "stator-resistance-dc") if direct else None,
    )


def choose_for_inductance(bench: Bench, reading: float | None, share: float | None, wanted: float) -> InstrumentChoice:
    """Choose for a line inductance (H), None where it is not known yet.

    `share` is the bench's meter's standard uncertainty over that reading, `wanted` what is asked for.
    """
    step = bench.has(Role.SUPPLY) and bench.has(Role.OSCILLOSCOPE)
    if reading is None:
        rule = text("the inductance is not known yet: a bridge at 1 kHz is right for every value")
    elif reading >= INDUCTANCE_RULE:
        rule = text("{value:.3g} mH between lines is tens of mH: an RLC meter will do", value=1e3 * reading)
    else:
        rule = text(
            "{value:.3g} µH between lines is below tens of mH: a bridge at 1 kHz is needed", value=1e6 * reading
        )
    return _choice(
        bench,
        rule,
        small=reading is None or reading < INDUCTANCE_RULE,
        reading_known=reading is not None,
        share=share,
        wanted=wanted,
        here="dq-inductance-extremes",
        instead=(text("step response"), "dq-inductance-time-constant") if step else None,
    )


def _choice(
    bench: Bench,
    rule: Text,
    *,
    small: bool,
    reading_known: bool,
    share: float | None,
    wanted: float,
    here: str,
    instead: tuple[Text, str] | None,
) -> InstrumentChoice:
    meter = bench.lcr_meter
    name = word(f"{meter.identity.manufacturer} {meter.identity.model}".strip() or "LCR meter")
    reasons = [rule]
    # What tells a precision bridge from a hand-held meter is what it states, not who reads it.
    fits = share <= wanted if share is not None else not (small and reading_known)
    unstated = share is None and small and reading_known
    if unstated:
        reasons.append(text("{name} states no accuracy there", name=name))
    if share is not None:
        reasons.append(
            text(
                "{name} measures it to {share:.2%} there, but {wanted:.2%} are required",
                name=name,
                share=share,
                wanted=wanted,
            )
        )
    if fits or instead is None:
        if not fits:
            reasons.append(text("the station has nothing better for it"))
        return InstrumentChoice(name, here, tuple(reasons), short=not fits, unstated=unstated)
    way, procedure = instead
    reasons.append(
        text("the station has the instruments for {procedure}, which is more accurate here", procedure=word(procedure))
    )
    return InstrumentChoice(way, procedure, tuple(reasons), short=False, unstated=unstated)
