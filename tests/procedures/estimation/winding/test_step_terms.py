"""Derivatives of a disturbed step's model against difference quotients of the model itself."""

import numpy as np
import pytest

from procedures.estimation.winding.current_step import term as step_term
from procedures.estimation.winding.current_step.divider import Divider
from procedures.estimation.winding.current_step.record import read_step
from procedures.estimation.winding.current_step.ringing import Resonance, RingingEdge
from procedures.estimation.winding.current_step.term import StepModel, StepScale, Term
from procedures.estimation.winding.current_step.terms import TERMS
from tests.studies.worlds.disturbed_steps import Batch, sampled

FIGURES = {
    "_Skew": (0.013,),
    "_Pole": (0.05,),
    "_Saturation": (0.8,),
    "_FluxSaturation": (0.5,),
    "_BiasedSaturation": (0.3,),
    "_MagnetSaturation": (-0.3, 0.4),
    "BentChannel": (0.1, 0.2),
    "_Eddy": (0.3, 0.2),
    "_Coupling": (0.1,),
    "_VoltageCoupling": (0.1,),
    "_Slope": (0.01,),
    "_Hum": (0.01, 0.02),
    "_Third": (0.01, 0.02),
    "RingingEdge": (0.01, 0.02, 0.1, -0.1),
    "Resonance": (0.1, -0.1),
    "Divider": (0.1, 0.2),
}


@pytest.mark.parametrize(
    "terms",
    [
        *((term,) for term in TERMS[:-1]),
        (TERMS[2], TERMS[7], TERMS[1]),
        (TERMS[8], TERMS[3], TERMS[10]),
        (TERMS[10], TERMS[1], TERMS[6]),
        (Resonance(), RingingEdge()),
        (Divider(),),
    ],
    ids=lambda terms: "+".join(type(t).__name__ for t in terms),
)
def test_derivatives_are_those_of_the_model(terms: tuple[Term, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step_term, "_PRECISION", 1e-12)
    monkeypatch.setattr(step_term, "_PRECISION_OF_SLOPES", 1e-9)
    monkeypatch.setattr(step_term, "_ROUNDS", 300)
    batch = Batch(1, np.random.default_rng(2), points=600, fine=2)
    batch.rise[:] = 0.0
    (taken,) = sampled(batch, bits=12)
    record = read_step(taken.time, taken.voltage, taken.current, taken.voltage_step, taken.current_step)
    assert record.sharp
    tau = taken.inductance
    model = StepModel(record, terms, StepScale(tau, 1.0, float(record.time[record.edge]), float(np.ptp(record.time))))
    figures = np.concatenate([FIGURES[type(t).__name__] for t in terms])
    at = np.concatenate(([1.0, tau, 0.01, 0.002, 0.2 * record.step], figures))
    sizes = np.concatenate(([1.0, tau, 1.0, 0.1, record.step], np.ones(figures.size)))

    def read(values: np.ndarray) -> np.ndarray:
        p, own = values[:5], values[5:]
        return model.read(model.flowing(p, own), p, own)

    flowing = model.flowing(at[:5], figures)
    slopes = model.read_slopes(flowing, model.flowing_slopes(flowing, at[:5], figures), figures)
    for k, size in enumerate(sizes):
        # A delay moves a kink from sample to sample: its quotient is one over a whole sample.
        by = 0.5 * record.step / tau if k >= 5 and terms == (TERMS[0],) else 1e-5 * size
        step = by * np.eye(at.size)[k]
        quotient = (read(at + step) - read(at - step)) / (2.0 * by)
        assert np.max(np.abs(slopes[k] - quotient)) < 1e-4 * np.max(np.abs(quotient))
