"""motulator: a Python module with the machine's parameters and the current over the flux linkage, for its saturated machine model."""

from reports.exports.comments import HASH, head
from reports.exports.exported_map import FloatArray
from reports.exports.map_quantities import MAP_POLE_PAIRS, MAP_RESISTANCE
from reports.exports.maps.interpolation import map_of, said_of
from reports.exports.target import Field, Sheet, Target

_CODE = '''
i_d = np.array(I_D)
i_q = np.array(I_Q)
#: Rows over i_d, columns over i_q.
psi_d = np.array(PSI_D)
psi_q = np.array(PSI_Q)
measured = np.array(MEASURED, dtype=bool)

_surface_d, _surface_q = RectBivariateSpline(i_d, i_q, psi_d), RectBivariateSpline(i_d, i_q, psi_q)
_grid_d, _grid_q = np.meshgrid(i_d, i_q, indexing="ij")
_near = LinearNDInterpolator(
    np.column_stack((psi_d.ravel(), psi_q.ravel())), (_grid_d + 1j * _grid_q).ravel()
)


def psi_s(i_s):
    """Return the stator flux linkage (V*s) at a stator current (A), complex, peak."""
    i_s = np.asarray(i_s)
    return _surface_d.ev(i_s.real, i_s.imag) + 1j * _surface_q.ev(i_s.real, i_s.imag)


def i_s(psi_s):
    """Return the stator current (A) at a stator flux linkage (V*s), complex, peak. Raises ValueError beyond the map."""
    psi = np.asarray(psi_s)
    found = np.asarray(_near(psi.real, psi.imag))
    if np.any(np.isnan(found.real)):
        raise ValueError("the flux linkage lies beyond the flux map; drive the machine within its currents")
    for _ in range(4):
        d, q = found.real, found.imag
        left_d, left_q = psi.real - _surface_d.ev(d, q), psi.imag - _surface_q.ev(d, q)
        dd, dq = _surface_d.ev(d, q, dx=1), _surface_d.ev(d, q, dy=1)
        qd, qq = _surface_q.ev(d, q, dx=1), _surface_q.ev(d, q, dy=1)
        size = dd * qq - dq * qd
        found = found + ((qq * left_d - dq * left_q) + 1j * (dd * left_q - qd * left_d)) / size
    return complex(found) if found.ndim == 0 else found


#: Give both to motulator.drive.model.SynchronousMachine(par, i_s=i_s, psi_s0=psi_s0).
psi_s0 = float(_surface_d.ev(0.0, 0.0))
par = SynchronousMachinePars(
'''


def write(sheet: Sheet) -> str:
    """Return a module that defines `par`, `i_s` and `psi_s0`."""
    found = map_of(sheet)
    lines = list(
        head(sheet, HASH, "motulator: saturated synchronous machine, SynchronousMachine(par, i_s=i_s, psi_s0=psi_s0)")
    )
    lines += [HASH.comment(words) for words in said_of(found)]
    lines += ["import numpy as np", "from motulator.drive.utils import SynchronousMachinePars"]
    lines += ["from scipy.interpolate import LinearNDInterpolator, RectBivariateSpline"]
    code = _CODE
    values = {"I_D": found.i_d, "I_Q": found.i_q, "PSI_D": found.psi_d, "PSI_Q": found.psi_q}
    for name, table in values.items():
        code = code.replace(f"({name})", f"({_python(table)})")
    code = code.replace("MEASURED", str(found.measured.astype(int).tolist()))
    lines += [code.strip("\n")]
    lines += [f"    {line.name}={line.text},  {HASH.comment(line.comment)}" for line in sheet.lines]
    return "\n".join([*lines, "    psi_f=psi_s0,", ")", ""])


def _python(table: FloatArray) -> str:
    rows = table if table.ndim == 2 else table[None, :]
    shown = ["[" + ", ".join(f"{value:.9g}" for value in row) + "]" for row in rows]
    return shown[0] if table.ndim == 1 else "[\n    " + ",\n    ".join(shown) + ",\n]"


TARGET = Target(
    "motulator-map",
    "motulator, flux map",
    ".py",
    (Field("n_p", MAP_POLE_PAIRS), Field("R_s", MAP_RESISTANCE)),
    write,
    of_map=True,
)
