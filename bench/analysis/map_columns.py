"""Currents and flux linkages of a table of a motor, whichever columns it states them by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from bench.analysis.map_table import TORQUE, read_table
from bench.analysis.table_headings import KnownColumn
from bench.analysis.table_outcome import digits_of
from bench.i18n.errors import InputError, UsageError, at
from drivers.interfaces.text import Text, text
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.published_map import on_grid

#: From where a current's angle counts, and which way: from q towards −d, from q towards d, or from d towards q.
AngleFrom = Literal["q", "q-to-d", "d"]

_KNOWN = {
    "i_d": KnownColumn("A", ("id", "currentd", "dcurrent")),
    "i_q": KnownColumn("A", ("iq", "currentq", "qcurrent")),
    "psi_d": KnownColumn("V·s", ("psid", "fluxd", "phid", "dflux", "fd")),
    "psi_q": KnownColumn("V·s", ("psiq", "fluxq", "phiq", "qflux", "fq")),
    "u_psi_d": KnownColumn("V·s", ("upsid",)),
    "u_psi_q": KnownColumn("V·s", ("upsiq",)),
    "torque": KnownColumn("N·m", (*TORQUE, "tem", "te")),
    "current": KnownColumn("A", ("i", "i1", "is", "current")),
    "angle": KnownColumn("rad", ("gamma", "γ", "beta", "β", "angle", "currentangle")),
    "l_d": KnownColumn("H", ("ld",)),
    "l_q": KnownColumn("H", ("lq",)),
    "flux_linkage": KnownColumn("V·s", ("psim", "psipm", "psif", "psi", "fluxpm", "flux")),
    "u_l_d": KnownColumn("H", ("uld",)),
    "u_l_q": KnownColumn("H", ("ulq",)),
    "u_flux_linkage": KnownColumn("V·s", ("upsim", "upsipm", "upsif", "upsi")),
}
#: What stands in place of another column, and what is not looked for where another column is there.
_INSTEAD = {"i_d": "current", "i_q": "angle", "psi_d": "l_d", "psi_q": "l_q"}
_UNLESS = {"i_d": ("current", "angle"), "psi_d": ("l_d", "l_q", "flux_linkage", "u_l_d", "u_l_q", "u_flux_linkage")}
#: A column of the magnets' flux linkage that differs from its mean by no more (share) is one value, not one over the currents.
_ONE = 1e-3


@dataclass(frozen=True)
class MapColumns:
    """Currents (n, 2) in A and flux linkages (n, 2) in V·s of a table's rows, with standard uncertainties and torque (N·m) where it
    has them; `digits` is the last digit of its numbers, share of the largest.
    """

    points: FloatArray
    flux: FloatArray
    uncertainty: FloatArray | None
    torque: FloatArray | None
    digits: float
    assumptions: Sequence[Text]


def map_columns(
    path: Path,
    mapped: Sequence[str],
    *,
    angle_from: AngleFrom | None = None,
    flux_linkage: float | None = None,
    u_flux_linkage: float = 0.0,
) -> MapColumns:
    """Return what a table states of a motor's flux linkages over its currents.

    In place of i_d and i_q it may have current and angle, counted as `angle_from` says; in place of ψ_d and ψ_q apparent inductances, with
    the magnets' flux linkage (V·s) in a column or given. Raises InputError for a table that cannot be used, UsageError where what it needs
    is not given.
    """
    columns = read_table(path, _KNOWN, tuple(_INSTEAD), mapped, instead=_INSTEAD, unless=_UNLESS)
    for name in (name for name in columns if name.startswith("u_")):
        if np.any(columns[name] < 0.0):
            raise InputError(
                at(
                    str(path),
                    text(
                        "{name} has {least:g} {unit}, but an uncertainty is 0 or more; correct the column or leave it out",
                        name=name,
                        least=float(np.nanmin(columns[name])),
                        unit=_KNOWN[name].unit,
                    ),
                )
            )
    points, read = _currents(path, columns, angle_from)
    if "psi_d" in columns:
        if flux_linkage is not None:
            raise UsageError(
                text("--flux-linkage: {path} has flux linkages; this is for a table of inductances", path=str(path))
            )
        flux = np.column_stack((columns["psi_d"], columns["psi_q"]))
        spread = None
        if {"u_psi_d", "u_psi_q"} <= set(columns):
            spread = np.column_stack((columns["u_psi_d"], columns["u_psi_q"]))
        digits = digits_of({name: columns[name] for name in ("psi_d", "psi_q", *read)})
        return MapColumns(points, flux, spread, columns.get("torque"), digits, ())
    given = columns.get("flux_linkage")
    if (given is None) == (flux_linkage is None):
        raise UsageError(
            text(
                "{path} has inductances: give the magnets' flux linkage either in a column flux_linkage or by --flux-linkage",
                path=str(path),
            )
        )
    magnets = np.full(len(points), flux_linkage) if given is None else given
    u_magnets = columns.get("u_flux_linkage", np.full(len(points), u_flux_linkage))
    # Without a current an inductance says nothing, and a table may have no number there.
    along, across = (np.where(points[:, k] == 0.0, 0.0, columns[name]) for k, name in enumerate(("l_d", "l_q")))
    flux = np.column_stack((magnets + along * points[:, 0], across * points[:, 1]))
    spread = None
    if {"u_l_d", "u_l_q"} <= set(columns):
        of_d, of_q = (np.where(points[:, k] == 0.0, 0.0, columns[name]) for k, name in enumerate(("u_l_d", "u_l_q")))
        spread = np.column_stack((np.hypot(u_magnets, of_d * points[:, 0]), of_q * np.abs(points[:, 1])))
    torque = columns.get("torque")
    alone = float(np.nanmean(magnets))
    if np.nanmax(np.abs(magnets - alone)) <= _ONE * abs(alone) and not np.any(np.all(points == 0.0, axis=1)):
        # What the magnets link without a current is known without a row.
        points, flux = np.vstack((points, (0.0, 0.0))), np.vstack((flux, (alone, 0.0)))
        spread = None if spread is None else np.vstack((spread, (float(np.nanmean(u_magnets)), 0.0)))
        torque = None if torque is None else np.append(torque, np.nan)
    digits = digits_of({name: columns[name] for name in ("l_d", "l_q", *read)})
    apparent = text(
        "inductances are taken as apparent ones, ψ_d = λ + L_d·i_d and ψ_q = L_q·i_q; differential ones make a wrong map"
    )
    return MapColumns(points, flux, spread, torque, digits, (apparent,))


def _currents(
    path: Path, columns: Mapping[str, FloatArray], angle_from: AngleFrom | None
) -> tuple[FloatArray, Sequence[str]]:
    """Return the currents (n, 2) in A, and which columns of them are readings: set points are exact, however round."""
    if "i_d" in columns:
        if angle_from is not None:
            raise UsageError(text("--angle-from: {path} has d and q currents and no angle", path=str(path)))
        points = np.column_stack((columns["i_d"], columns["i_q"]))
        return points, () if on_grid(points) else ("i_d", "i_q")
    if angle_from is None:
        raise UsageError(
            text(
                "{path} has currents by amount and angle: say with --angle-from where the angle counts from: q (from q towards −d), q-to-d "
                "(from q towards d) or d (from d towards q)",
                path=str(path),
            )
        )
    size, angle = columns["current"], columns["angle"]
    sine, cosine = np.sin(angle), np.cos(angle)
    d, q = {"q": (-sine, cosine), "q-to-d": (sine, cosine), "d": (cosine, sine)}[angle_from]
    points = size[:, None] * np.column_stack((d, q))
    # A quarter turn is not exact in floating point.
    points[np.abs(points) < 1e-9 * float(np.nanmax(np.abs(size), initial=0.0))] = 0.0
    return points, () if on_grid(np.column_stack((size, angle))) else ("current",)
