"""Effect of closed circuits coupled to a winding on its current step."""

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.winding.current_step.circuit import response
from procedures.estimation.winding.current_step.record import StepRecord
from procedures.estimation.winding.current_step.term import high_pass

#: Time constants that the winding's other axis may have, in those of the stepped one.
_OTHER_AXIS = (0.4, 1.0, 2.5)


def closed_circuits(record: StepRecord, rate: float, flowing: FloatArray, lags: tuple[float, ...]) -> FloatArray:
    """Return ∂current/∂k² (m, n), at none, of closed circuits with time constants of `lags` (m,) times that of the winding, 1/`rate` (s).

    `flowing` (A, shape (n,)) is the current from the step on.
    """
    missing = np.array([high_pass(flowing, record.step, rate / lag) for lag in lags])
    return high_pass(missing, record.step, rate)


def other_axis_errors(record: StepRecord, p: FloatArray) -> FloatArray:
    """Return errors of the current's model (A, shape (m, n)) of one standard deviation each, from the winding's other axis: no rows where
    it is not coupled.
    """
    result = np.zeros((len(_OTHER_AXIS) if record.other_axis else 0, record.time.size))
    if record.other_axis:
        after = slice(max(record.edge - 1, 0), None)
        flowing = response(record, p)[after]
        result[:, after] = record.other_axis * closed_circuits(record, p[0] / p[1], flowing, _OTHER_AXIS)
    return result
