"""MathWorks Motor Control Blockset: the struct that mcb.getPMSMParameters gives for its own motors."""

from reports.exports import quantities as q
from reports.exports.comments import MATLAB, head
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return a script that fills the struct `pmsm`."""
    lines = list(head(sheet, MATLAB, "MathWorks Motor Control Blockset: run it, then use the struct pmsm"))
    lines.append(f"pmsm.model = {_string(sheet.subject.motor)};")
    lines.append(f"pmsm.sn = {_string(sheet.subject.serial_number)};")
    lines += [f"{line.name} = {line.text}; {MATLAB.comment(line.comment)}" for line in sheet.lines]
    return "\n".join([*lines, ""])


def _string(words: str) -> str:
    return "'" + MATLAB.safe(words).replace("'", "''") + "'"


TARGET = Target(
    "mathworks",
    "MathWorks Motor Control Blockset",
    ".m",
    (
        Field("pmsm.p", q.POLE_PAIRS),
        Field("pmsm.Rs", q.RESISTANCE),
        Field("pmsm.Ld", q.D_INDUCTANCE),
        Field("pmsm.Lq", q.Q_INDUCTANCE),
        Field("pmsm.J", q.INERTIA),
        Field("pmsm.B", q.VISCOUS_FRICTION),
        Field("pmsm.Ke", q.EMF_PEAK_LINE),
        Field("pmsm.Kt", q.TORQUE_CONSTANT),
        Field("pmsm.FluxPM", q.FLUX_LINKAGE),
        Field("pmsm.I_rated", q.RATED_CURRENT),
        Field("pmsm.N_max", q.LARGEST_SPEED),
    ),
    write,
)
