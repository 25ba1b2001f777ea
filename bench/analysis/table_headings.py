"""Headings of tables that others wrote: names, units, and whether they say rms."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bench.captures.text import number
from bench.captures.units import si

#: Units that are not of captures, with SI unit and factor.
_UNITS = {
    "vs": ("V·s", 1.0), "v·s": ("V·s", 1.0), "v*s": ("V·s", 1.0), "wb": ("V·s", 1.0), "mvs": ("V·s", 1e-3), "mwb": ("V·s", 1e-3),
    "mv·s": ("V·s", 1e-3), "mv*s": ("V·s", 1e-3),
    **dict.fromkeys(("uvs", "µvs", "μvs", "uwb", "µwb", "μwb"), ("V·s", 1e-6)),
    **dict.fromkeys(("°c", "degc", "deg c", "celsius", "℃"), ("°C", 1.0)),
    "w": ("W", 1.0), "watt": ("W", 1.0), "watts": ("W", 1.0), "kw": ("W", 1e3),
}  # fmt: skip
#: What a refusal offers for a unit.
_OFFERED = {
    "A": ("A", "mA", "A rms"), "V·s": ("Vs", "mVs", "Wb", "mWb"), "N·m": ("Nm", "mNm"), "W": ("W", "kW"), "rad/s": ("rpm", "rad/s"),
    "H": ("H", "mH", "uH"), "rad": ("deg", "rad"), "V": ("V", "mV"), "Hz": ("Hz", "kHz"), "°C": ("°C",),
}  # fmt: skip
_RMS = re.compile(r"[\s_,]*(?:rms|eff)(?![a-z])")
_PEAK = re.compile(r"[\s_,]*(?:peak|pk)(?![a-z-])")
#: Where a heading's unit may stand: in brackets, after "in", after a blank or an underscore, a quotient or not, after a stroke.
_PLACES = (
    re.compile(r"[\s_]*[\[(]\s*([^\[\]()]+?)\s*[\])]$"),
    re.compile(r"\s+in\s+(\S+)$"),
    re.compile(r"[\s_]+((?:rad|deg)[_/]s|m?n_m|[^\s\[\]()_]+)$"),
    re.compile(r"\s*/\s*([^\s\[\]()/_]+)$"),
)


@dataclass(frozen=True)
class KnownColumn:
    """A column that is looked for: its SI unit, and the headings that it may have, plain."""

    unit: str
    headings: tuple[str, ...]


@dataclass(frozen=True)
class Heading:
    """A heading's name, plain, and its unit (SI) with its factor, from rms to peak where it says rms; an empty unit where it says none."""

    name: str
    unit: str = ""
    factor: float = 1.0
    rms: bool = False


def split(heading: str, known: Mapping[str, KnownColumn]) -> Heading:
    """Return a heading's name and unit; one that is a unit only, as "rpm", is both."""
    plain, rms = _without_kind(heading)
    for pattern in _PLACES:
        match = pattern.search(plain)
        unit = _unit(match[1]) if match and match.start() > 0 else None
        if match and unit is not None:
            return Heading(_plain(plain[: match.start()]), unit[0], unit[1] * (math.sqrt(2.0) if rms else 1.0), rms)
    name, unit = _plain(plain), _unit(plain)
    if unit is not None and any(name in column.headings and column.unit == unit[0] for column in known.values()):
        return Heading(name, *unit)
    # A unit that is not known is said to be none, of the column that bears it.
    bare = _plain(_PLACES[0].sub("", plain))
    return Heading(bare if any(bare in column.headings for column in known.values()) else name, rms=rms)


def unit_row(cells: Sequence[str]) -> list[Heading] | None:
    """Return what the cells of a row below the heading say of units, nothing of one that is not known; None where it is no row of units."""
    found: list[Heading | None] = []
    for cell in cells:
        plain, rms = _without_kind(cell.strip().strip("[]()"))
        unit = None if plain in ("", "-") else _unit(plain)
        if number(plain.replace(",", ".")) is not None:
            return None
        factor = math.sqrt(2.0) if rms else 1.0
        found.append(Heading("") if plain in ("", "-") else unit and Heading("", unit[0], unit[1] * factor, rms))
    named = [each for each in found if each is None or each.unit]
    if 2 * sum(each is not None for each in named) < len(named) or not any(named):
        return None if named else [Heading("")] * len(cells)
    return [each or Heading("") for each in found]


def bare(heading: str) -> str:
    """Return a heading without what stands in brackets at its end."""
    return _PLACES[0].sub("", heading)


def offered_units(unit: str) -> Sequence[str]:
    """Return what a refusal offers for an SI unit."""
    return _OFFERED[unit]


def _without_kind(words: str) -> tuple[str, bool]:
    """Return words in small letters without what they say of rms or peak, and whether they say rms."""
    plain, rms = _RMS.subn("", words.strip().lower())
    return _PEAK.sub("", plain).strip(), bool(rms)


def _unit(words: str) -> tuple[str, float] | None:
    plain = re.sub(r"^(m?n)[ ._\-]m$", r"\1m", words.replace("rad_s", "rad/s").replace("rad s-1", "rad/s"))
    return _UNITS.get(plain) or si(plain)


def _plain(name: str) -> str:
    return (
        re.sub(r"[\s_]+", "", name)
        .replace("ψ", "psi")
        .replace("λ", "psi")
        .replace("ω", "w")
        .replace("lambda", "psi")
        .replace("fluxlinkage", "flux")
    )
