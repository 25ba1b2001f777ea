"""motulator: a Python module with the machine's parameters."""

from reports.exports import quantities as q
from reports.exports.comments import HASH, head
from reports.exports.target import Field, Sheet, Target


def write(sheet: Sheet) -> str:
    """Return a module that defines `par`."""
    lines = list(head(sheet, HASH, "motulator: synchronous machine parameters, amplitude-invariant"))
    lines += ["from motulator.drive.utils import SynchronousMachinePars", "", "par = SynchronousMachinePars("]
    lines += [f"    {line.name}={line.text},  {HASH.comment(line.comment)}" for line in sheet.lines]
    return "\n".join([*lines, ")", ""])


TARGET = Target(
    "motulator",
    "motulator",
    ".py",
    (
        Field("n_p", q.POLE_PAIRS),
        Field("R_s", q.RESISTANCE),
        Field("L_d", q.D_INDUCTANCE),
        Field("L_q", q.Q_INDUCTANCE),
        Field("psi_f", q.FLUX_LINKAGE),
    ),
    write,
)
