"""Faults of magnets, Hall sensors, bearings and insulation."""

import math
from collections.abc import Iterator, Sequence

from bench.eol.diagnosis.diagnosed import Diagnosis, Evidence, FaultyPart
from drivers.interfaces.text import Text, text

_PER_CENT = 100.0
#: A second harmonic (relative) above this is of one magnet: what is the same under every pole has no even orders.
_EVEN = 0.01
#: From this share of a pole's flux on a magnet is missing, and from the next reversed.
_MISSING, _REVERSED = 0.85, 1.5
#: Of a drag that is larger once a turn by this share of its mean, the rotor rubs.
_RUBBING = 0.3
#: The second harmonic of a half wave of flux that is missing, over its share of an electrical period's flux.
_SECOND = 4.0 / (3.0 * math.pi)


def magnet_faults(evidence: Evidence) -> Iterator[Diagnosis]:
    """Give what flux and its harmonics say of one magnet, of all of them, or of another type."""
    pairs = evidence.values.get("pole_pairs")
    if "pole_pairs" in evidence.outside and pairs is not None:
        yield Diagnosis(FaultyPart.TYPE, "", text("another type: {pairs:g} pole pairs", pairs=pairs))
        return
    harmonics: Sequence[float] = evidence.of("back-emf-shape", "harmonics") or []
    # The first is the fundamental; all are per cent of it.
    second = harmonics[1] / _PER_CENT if len(harmonics) > 1 else 0.0
    if second > _EVEN and {"back_emf_thd", "flux_linkage", "back_emf_unbalance"} & evidence.outside.keys():
        yield Diagnosis(FaultyPart.MAGNET, "", _one_magnet(second, pairs or evidence.expected.get("pole_pairs")))
    elif "flux_linkage" in evidence.outside:
        yield from _all_magnets(evidence)
    elif "back_emf_thd" in evidence.outside:
        thd = evidence.values["back_emf_thd"]
        yield Diagnosis(
            FaultyPart.MAGNETS, "", text("shape of the back-EMF: distortion {thd:.2f} %, no even order", thd=thd)
        )


def _one_magnet(second: float, pairs: float | None) -> Text:
    if pairs is None:
        return text(
            "one magnet is weak, missing or reversed: 2nd harmonic {second:.2f} %, which equal poles do not have",
            second=_PER_CENT * second,
        )
    lost = pairs * second / (_SECOND + 0.5 * second)
    how = text("weak")
    if lost > _REVERSED:
        how = text("reversed")
    elif lost > _MISSING:
        how = text("missing")
    return text(
        "one magnet is {how}: 2nd harmonic {second:.2f} %, as of a pole that lacks {lost:.0f} % of its flux",
        how=how,
        second=_PER_CENT * second,
        lost=_PER_CENT * lost,
    )


def _all_magnets(evidence: Evidence) -> Iterator[Diagnosis]:
    flux = _PER_CENT * (evidence.outside["flux_linkage"] - 1.0)
    resistance = evidence.outside.get("stator_resistance", math.nan)
    if math.isnan(flux):
        return
    if not math.isnan(resistance) and (resistance - 1.0) * flux > 0.0:
        message = text(
            "another number of turns in all windings: flux {flux:+.1f} %, R {resistance:+.1f} % of the type's",
            flux=flux,
            resistance=_PER_CENT * (resistance - 1.0),
        )
        yield Diagnosis(FaultyPart.TYPE, "", message)
    elif flux > 0.0:
        yield Diagnosis(FaultyPart.TYPE, "", text("another type, or another winding: flux {flux:+.1f} %", flux=flux))
    elif "stator_resistance" in evidence.values:
        message = text("all magnets are weak: flux {flux:+.1f} %, resistance as the type's", flux=flux)
        yield Diagnosis(FaultyPart.MAGNETS, "", message)
    else:
        message = text(
            "all magnets are weak, or turns are missing in all windings: flux {flux:+.1f} %, the phases alike",
            flux=flux,
        )
        yield Diagnosis(FaultyPart.MAGNETS, "", message)


def hall_faults(evidence: Evidence) -> Iterator[Diagnosis]:
    """Give each sensor's lead that is dead, swapped, inverted or off its place."""
    found = evidence.findings.get("hall-sensors", {})
    faults = [str(fault).split(": ") for fault in found.get("faults", ())]
    dead = [lead for lead, fault in faults if fault == "dead"]
    if len(dead) == len(found.get("leads", ())) > 0:
        message = text("no Hall sensor switches: connector, supply of the sensors, or a motor without them")
        yield Diagnosis(FaultyPart.HALL, "", message)
        return
    for lead, fault in faults:
        yield Diagnosis(FaultyPart.HALL, lead, _hall_words(lead, fault))
    if faults or not found.get("leads"):
        return
    if "hall_spacing_deviation" in evidence.outside or "hall_duty_deviation" in evidence.outside:
        lead = _misplaced({name: place for name, place in found["leads"].items() if place})
        off = evidence.values.get("hall_spacing_deviation", math.nan)
        yield Diagnosis(
            FaultyPart.HALL, lead, text("Hall sensor {lead} is off its place by {off:.1f}°", lead=lead, off=off)
        )
    elif "hall_offset" in evidence.outside:
        offset = evidence.values["hall_offset"]
        yield Diagnosis(FaultyPart.HALL, "", text("all Hall sensors are turned: offset {offset:.1f}°", offset=offset))


def _hall_words(lead: str, fault: str) -> Text:
    return {
        "dead": text("Hall lead {lead} is dead: sensor, lead or contact", lead=lead),
        "inverted": text("Hall lead {lead} is inverted: sensor turned over", lead=lead),
    }.get(fault, text("Hall lead {lead} is exchanged with another", lead=lead))


def _misplaced(leads: dict[str, dict[str, float]]) -> str:
    """Return the lead whose edges lie farthest from the middle between the other two's."""
    if len(leads) < 3:
        return "/".join(leads)
    # Of the part that is high: half a turn apart, the nearer way from edge to edge is a matter of chance.
    middle = {name: place["rise"] + 0.5 * ((place["fall"] - place["rise"]) % 360.0) for name, place in leads.items()}

    def off(name: str) -> float:
        one, other = (middle[each] for each in middle if each != name)
        # Opposite the middle of the other two is where it belongs.
        return abs(_turned(middle[name] - _middle(one, other) - 180.0))

    return max(middle, key=off)


def _middle(one: float, other: float) -> float:
    return one + 0.5 * _turned(other - one)


def _turned(angle: float) -> float:
    return (angle + 180.0) % 360.0 - 180.0


def drag_faults(evidence: Evidence) -> Iterator[Diagnosis]:
    """Give what hinders the rotor: bearing or a rotor that rubs, and cogging."""
    drag = {"no_load_current", "no_load_bus_current", "coulomb_friction", "viscous_friction"} & evidence.outside.keys()
    torque = evidence.of("no-load-current", "drag")
    once = evidence.of("no-load-current", "drag_once_a_turn")
    if drag and torque is not None and once is not None and once > _RUBBING * torque:
        message = text(
            "rotor rubs: once a turn it drags {most:.3g} N·m, {torque:.3g} N·m on average",
            torque=float(torque),
            most=float(torque) + float(once),
        )
        yield Diagnosis(FaultyPart.BEARING, "", message)
    elif drag and torque is not None:
        message = text(
            "bearing tight, or rotor rubs: it drags {torque:.3g} N·m, {current:.3g} A",
            torque=float(torque),
            current=evidence.values.get("no_load_current", math.nan),
        )
        yield Diagnosis(FaultyPart.BEARING, "", message)
    elif "no_load_current" in evidence.least:
        message = text(
            "rotor rubs, or bearing is rough: uneven drag of {current:.2g} A at least",
            current=evidence.least["no_load_current"],
        )
        yield Diagnosis(FaultyPart.BEARING, "", message)
    elif "coulomb_friction" in evidence.least:
        message = text(
            "bearing tight, or rotor rubs: it drags {torque:.2g} N·m at least",
            torque=evidence.least["coulomb_friction"],
        )
        yield Diagnosis(FaultyPart.BEARING, "", message)
    elif drag:
        yield Diagnosis(FaultyPart.BEARING, "", text("bearing tight, or rotor rubs"))
    if "bearing" in evidence.broken:
        yield Diagnosis(
            FaultyPart.HELD,
            "",
            text(
                "bearing seized, coupling jammed or rotor still locked: the dynamometer turns when uncoupled, but "
                "does not turn the motor. Uncouple the motor and turn its shaft by hand. If it turns, check the "
                "coupling and the lock, and test the motor again"
            ),
        )
    if "cogging_torque" in evidence.outside:
        message = text(
            "cogging {torque:.3g} N·m peak to peak: a loose magnet, skew or slots",
            torque=evidence.values["cogging_torque"],
        )
        yield Diagnosis(FaultyPart.COGGING, "", message)


def insulation_faults(evidence: Evidence) -> Iterator[Diagnosis]:
    """Give an insulation that is too weak, or breaks down."""
    if "insulation" in evidence.broken:
        yield Diagnosis(FaultyPart.INSULATION, "", text("insulation between winding and frame breaks down"))
    if "insulation_resistance" in evidence.outside:
        message = text(
            "insulation between winding and frame: {resistance:.3g} MΩ",
            resistance=1e-6 * evidence.values["insulation_resistance"],
        )
        yield Diagnosis(FaultyPart.INSULATION, "", message)
