"""The initial values of the fit of a current step: resistance and inductance from an integral equation."""

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray, WithheldError
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.winding.current_step.record import StepRecord

#: A current that has fallen to this share of its largest has died away for one time constant.
_DIED_AWAY = 0.3679
#: So many samples of a rise give a start.
_LEAST_RISE = 20


def start_of(record: StepRecord) -> FloatArray:
    """Return resistance, inductance and current offset from ∫v dt = R·∫i dt + L·i, linear and indifferent to the supply's shape.

    The voltage's offset and the delay, which follow, are none. Raises EstimationError where no circuit does that, and WithheldError where
    the current's channel is AC coupled.
    """
    offset = float(np.mean(record.current[: record.edge]))
    last = record.time.size if record.kept is None else int(np.flatnonzero(record.kept)[-1]) + 1
    v, i = record.drive[record.edge : last], record.current[record.edge : last] - offset
    least = 0.05 * record.step
    resistance, inductance = _circuit(v, i, record.step)
    if not (resistance > 0 and inductance > least * resistance):
        _check_coupling(record.time[record.edge : last], v, i)
        # A current that falls again, as through a high pass, is the circuit's as far as it rises.
        rise = slice(0, int(np.argmax(np.abs(i))) + 1)
        if i[rise].size >= _LEAST_RISE:
            resistance, inductance = _circuit(v[rise], i[rise], record.step)
    if not resistance > 0:
        raise EstimationError(
            "the current does not follow the voltage (negative resistance): reverse the current probe, couple its channel DC, or "
            "check that both probes are on the stepped circuit"
        )
    if not inductance > least * resistance:
        raise EstimationError(
            "the current follows the voltage within a sample: sample faster, or check the probes; exchanged channels look alike"
        )
    return np.array([resistance, inductance, offset, 0.0, 0.0])


def _circuit(voltage: FloatArray, current: FloatArray, step: float) -> FloatArray:
    """Return resistance and inductance from samples (V, A) that are `step` (s) apart."""

    def integral(x: FloatArray) -> FloatArray:
        return np.append(0.0, np.cumsum(0.5 * (x[1:] + x[:-1]))) * step

    design = np.array((integral(current), current, np.ones_like(current)))
    scale = np.sqrt(np.mean(design**2, axis=1))
    design /= scale[:, None]
    solution = np.linalg.lstsq(design @ design.T, design @ integral(voltage), rcond=None)[0] / scale
    return np.asarray(solution[:2])


def _check_coupling(time: FloatArray, voltage: FloatArray, current: FloatArray) -> None:
    """Raise WithheldError where the current follows the voltage and dies away under it: its channel is AC coupled."""
    along = current * float(np.sign(np.mean(voltage)))
    top = int(np.argmax(along))
    fallen = np.flatnonzero(along[top:] < _DIED_AWAY * along[top])
    if (
        not fallen.size
        or along[top] < -float(np.min(along))
        or np.mean(along[-max(1, along.size // 10) :]) > along[top] / 2
    ):
        return
    # The time to 1/e is the high pass's, as far as the circuit's own is shorter.
    corner = 1.0 / (2.0 * np.pi * float(time[top + fallen[0]] - time[top]))
    finding = Finding(
        Cause.AC_COUPLED, Answer.WITHHELD, figures={"record": "step", "channel": "current", "corner": corner}
    )
    raise WithheldError(
        "the current dies away under a lasting voltage: its channel is AC coupled; couple it DC", Misfit((finding,))
    )
