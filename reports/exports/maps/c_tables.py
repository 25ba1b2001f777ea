"""A C header with a flux map as tables, floating and fixed point, and the function that interpolates in each."""

import numpy as np
from numpy.typing import NDArray

from reports.exports.comments import C, head
from reports.exports.controllers.defines import defines
from reports.exports.exported_map import FloatArray
from reports.exports.map_quantities import MAP_POLE_PAIRS, MAP_RESISTANCE
from reports.exports.maps.interpolation import bilinear_error, map_of, said_of
from reports.exports.target import Field, Sheet, Target

_Q15 = 32767
_CODE = """
/* Place of a value among rising breakpoints: index of the one below; beyond the ends the last ones. */
static inline int flux_map_place(const float *axis, int size, float value)
{
    int k = 0;
    while (k < size - 2 && value >= axis[k + 1]) k++;
    return k;
}

/* Flux linkages (V*s) at currents (A), bilinear; currents beyond the table are taken at its edge. Returns 1 where all four neighbours
   were measured, 0 where the surface is carried on or the currents lie beyond the table. */
static inline int flux_map_psi(float id, float iq, float *psi_d, float *psi_q)
{
    int inside = id >= FLUX_MAP_ID_MIN && id <= FLUX_MAP_ID_MAX && iq >= FLUX_MAP_IQ_MIN && iq <= FLUX_MAP_IQ_MAX;
    if (id < FLUX_MAP_ID_MIN) id = FLUX_MAP_ID_MIN;
    if (id > FLUX_MAP_ID_MAX) id = FLUX_MAP_ID_MAX;
    if (iq < FLUX_MAP_IQ_MIN) iq = FLUX_MAP_IQ_MIN;
    if (iq > FLUX_MAP_IQ_MAX) iq = FLUX_MAP_IQ_MAX;
    int k = flux_map_place(flux_map_id, FLUX_MAP_ID_SIZE, id);
    int l = flux_map_place(flux_map_iq, FLUX_MAP_IQ_SIZE, iq);
    float a = (id - flux_map_id[k]) / (flux_map_id[k + 1] - flux_map_id[k]);
    float b = (iq - flux_map_iq[l]) / (flux_map_iq[l + 1] - flux_map_iq[l]);
    *psi_d = (1.0f - a) * ((1.0f - b) * flux_map_psi_d[k][l] + b * flux_map_psi_d[k][l + 1])
           + a * ((1.0f - b) * flux_map_psi_d[k + 1][l] + b * flux_map_psi_d[k + 1][l + 1]);
    *psi_q = (1.0f - a) * ((1.0f - b) * flux_map_psi_q[k][l] + b * flux_map_psi_q[k][l + 1])
           + a * ((1.0f - b) * flux_map_psi_q[k + 1][l] + b * flux_map_psi_q[k + 1][l + 1]);
    return inside && flux_map_measured[k][l] && flux_map_measured[k][l + 1]
        && flux_map_measured[k + 1][l] && flux_map_measured[k + 1][l + 1];
}

static inline int32_t flux_map_q15_between(int32_t from, int32_t to, int32_t part)
{
    int64_t scaled = (int64_t)(to - from) * part;
    return from + (int32_t)((scaled + (scaled < 0 ? -16384 : 16384)) / 32768);
}

/* The same in fixed point: currents in FLUX_MAP_Q15_CURRENT / 32767, flux linkages in FLUX_MAP_Q15_FLUX / 32767. */
static inline int flux_map_psi_q15(int16_t id, int16_t iq, int16_t *psi_d, int16_t *psi_q)
{
    const int16_t *d = flux_map_q15_id, *q = flux_map_q15_iq;
    int inside = id >= d[0] && id <= d[FLUX_MAP_ID_SIZE - 1] && iq >= q[0] && iq <= q[FLUX_MAP_IQ_SIZE - 1];
    int k = 0, l = 0;
    if (id < d[0]) id = d[0];
    if (id > d[FLUX_MAP_ID_SIZE - 1]) id = d[FLUX_MAP_ID_SIZE - 1];
    if (iq < q[0]) iq = q[0];
    if (iq > q[FLUX_MAP_IQ_SIZE - 1]) iq = q[FLUX_MAP_IQ_SIZE - 1];
    while (k < FLUX_MAP_ID_SIZE - 2 && id >= d[k + 1]) k++;
    while (l < FLUX_MAP_IQ_SIZE - 2 && iq >= q[l + 1]) l++;
    int32_t a = (int32_t)(((int64_t)(id - d[k]) * 32768) / (d[k + 1] - d[k]));
    int32_t b = (int32_t)(((int64_t)(iq - q[l]) * 32768) / (q[l + 1] - q[l]));
    *psi_d = (int16_t)flux_map_q15_between(
        flux_map_q15_between(flux_map_q15_psi_d[k][l], flux_map_q15_psi_d[k][l + 1], b),
        flux_map_q15_between(flux_map_q15_psi_d[k + 1][l], flux_map_q15_psi_d[k + 1][l + 1], b), a);
    *psi_q = (int16_t)flux_map_q15_between(
        flux_map_q15_between(flux_map_q15_psi_q[k][l], flux_map_q15_psi_q[k][l + 1], b),
        flux_map_q15_between(flux_map_q15_psi_q[k + 1][l], flux_map_q15_psi_q[k + 1][l + 1], b), a);
    return inside && flux_map_measured[k][l] && flux_map_measured[k][l + 1]
        && flux_map_measured[k + 1][l] && flux_map_measured[k + 1][l + 1];
}
"""


def write(sheet: Sheet) -> str:
    """Return the header, guarded."""
    found = map_of(sheet)
    current = float(max(np.max(np.abs(found.i_d)), np.max(np.abs(found.i_q))))
    flux = float(max(np.max(np.abs(found.psi_d)), np.max(np.abs(found.psi_q))))
    lines = list(head(sheet, C, "flux map as tables, SI units"))
    lines += [C.comment(words) for words in said_of(found)]
    lines += [
        "#ifndef FLUX_MAP_H",
        "#define FLUX_MAP_H",
        "",
        "#include <stdint.h>",
        "",
        *defines(sheet.lines, suffix="f"),
    ]
    bounds = {"ID_MIN": found.i_d[0], "ID_MAX": found.i_d[-1], "IQ_MIN": found.i_q[0], "IQ_MAX": found.i_q[-1]}
    lines += [
        f"#define FLUX_MAP_{name} ({_float(value)}) /* A, bound of the tables */" for name, value in bounds.items()
    ]
    lines += [f"#define FLUX_MAP_ID_SIZE {found.i_d.size}", f"#define FLUX_MAP_IQ_SIZE {found.i_q.size}"]
    lines += [
        f"#define FLUX_MAP_Q15_CURRENT ({_float(current)}) /* A at 32767 */",
        f"#define FLUX_MAP_Q15_FLUX ({_float(flux)}) /* V*s at 32767 */",
        f"#define FLUX_MAP_BILINEAR_ERROR ({_float(bilinear_error(found))}) /* V*s, largest, from a cubic surface where measured */",
        "",
        "/* Rows over id, columns over iq. */",
    ]
    for name, axis, size in (("id", found.i_d, "ID"), ("iq", found.i_q, "IQ")):
        lines.append(f"static const float flux_map_{name}[FLUX_MAP_{size}_SIZE] = {{{_floats(axis)}}};")
        lines.append(
            f"static const int16_t flux_map_q15_{name}[FLUX_MAP_{size}_SIZE] = {{{_whole(_fixed(axis, current))}}};"
        )
    for name, table in (("psi_d", found.psi_d), ("psi_q", found.psi_q)):
        lines += _table("float", f"flux_map_{name}", [_floats(row) for row in table])
        lines += _table("int16_t", f"flux_map_q15_{name}", [_whole(row) for row in _fixed(table, flux)])
    lines += _table("uint8_t", "flux_map_measured", [_whole(row.astype(np.int64)) for row in found.measured])
    return "\n".join([*lines, _CODE, "#endif", ""])


def _table(kind: str, name: str, rows: list[str]) -> list[str]:
    messages = [f"static const {kind} {name}[FLUX_MAP_ID_SIZE][FLUX_MAP_IQ_SIZE] = {{"]
    return [*messages, *(f"    {{{row}}}," for row in rows), "};"]


def _fixed(values: FloatArray, scale: float) -> NDArray[np.int64]:
    return np.rint(values / scale * _Q15).astype(np.int64)


def _whole(values: NDArray[np.int64]) -> str:
    return ", ".join(str(value) for value in values.tolist())


def _floats(values: FloatArray) -> str:
    return ", ".join(_float(value) for value in values)


def _float(value: float) -> str:
    shown = f"{value:.9g}"
    return f"{shown}f" if any(mark in shown for mark in ".e") else f"{shown}.0f"


TARGET = Target(
    "c-tables",
    "C tables of the flux map",
    ".h",
    (Field("FLUX_MAP_POLE_PAIRS", MAP_POLE_PAIRS), Field("FLUX_MAP_RESISTANCE", MAP_RESISTANCE)),
    write,
    of_map=True,
)
