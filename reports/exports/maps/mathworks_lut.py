"""MathWorks: flux linkages over currents, and currents over flux linkages for the Flux-Based PMSM block."""

from collections.abc import Iterator

from reports.exports.comments import MATLAB, head
from reports.exports.exported_map import FloatArray
from reports.exports.map_quantities import MAP_POLE_PAIRS, MAP_RESISTANCE
from reports.exports.maps.interpolation import currents_over_flux, flux_axes, map_of, said_of
from reports.exports.target import Field, Sheet, Target

_SIZE = 31


def write(sheet: Sheet) -> str:
    """Return a script that fills the struct `pmsm`."""
    found = map_of(sheet)
    flux_d, flux_q = flux_axes(found, _SIZE)
    id_table, iq_table = currents_over_flux(found, flux_d, flux_q)
    lines = list(head(sheet, MATLAB, "MathWorks: tables of the saturated PMSM; run it, then use the struct pmsm"))
    lines += [MATLAB.comment(words) for words in said_of(found)]
    lines += [f"{line.name} = {line.text}; {MATLAB.comment(line.comment)}" for line in sheet.lines]
    lines += _block(
        "flux linkages over currents: FluxD(k, l) is that at idVec(k), iqVec(l): rows over id, columns over iq"
    )
    lines += _table("idVec", found.i_d) + _table("iqVec", found.i_q)
    lines += _table("FluxD", found.psi_d) + _table("FluxQ", found.psi_q)
    lines += _table("measured", found.measured.astype(float))
    lines += _block(
        "currents over flux linkages, Flux-Based PMSM: id(k, l) is that at flux_d(k), flux_q(l): rows over flux_d"
    )
    lines += _block(
        "the rectangle of flux linkages lies within the grid of currents above, beyond what was measured too"
    )
    lines += _table("flux_d", flux_d) + _table("flux_q", flux_q) + _table("id", id_table) + _table("iq", iq_table)
    return "\n".join([*lines, ""])


def _block(words: str) -> list[str]:
    return [MATLAB.comment(words)]


def _table(name: str, values: FloatArray) -> list[str]:
    if values.ndim == 1:
        return [f"pmsm.{name} = [{_row(values)}];"]
    return [f"pmsm.{name} = [", *_rows(values), "];"]


def _rows(values: FloatArray) -> Iterator[str]:
    return (f"    {_row(row)};" for row in values)


def _row(values: FloatArray) -> str:
    return " ".join(f"{value:.9g}" for value in values)


TARGET = Target(
    "mathworks-lut",
    "MathWorks flux tables (LUT and Flux-Based PMSM)",
    ".m",
    (Field("pmsm.p", MAP_POLE_PAIRS), Field("pmsm.Rs", MAP_RESISTANCE)),
    write,
    of_map=True,
)
