"""What the scatter of a sweep may hide is in the interval."""

import numpy as np
import pytest

from procedures.core.bench import Bench
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.estimation.winding.sweep.rotor_sweep import saliency_significant
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep
from procedures.note.dq_inductance_extremes import DqInductanceExtremes, DqInductanceExtremesSettings
from sim_instruments.clock.virtual_clock import VirtualClock
from tests.studies.worlds.measured_motor import NoRecord


class NoHands:
    def perform(self, action: object) -> object:
        raise AssertionError(f"{action} is not asked for")


@pytest.mark.parametrize("seed", range(5))
def test_a_saliency_lost_in_the_scatter_is_allowed_for(seed: int) -> None:
    plate = Nameplate(name="x", connection=WindingConnection.WYE, rated_current=1.0, maximum_current=2.0)
    bench = Bench({}, NoHands(), VirtualClock(), NoRecord())
    procedure = DqInductanceExtremes(bench, plate, DqInductanceExtremesSettings(), {})
    time = np.linspace(0.0, 10.0, 96)
    scatter = np.random.default_rng(seed).normal(0.0, 1.0, 96)
    fit = fit_timed_sweep(time, 100.0 + 0.4 * np.cos(0.6 * np.pi * time) + scatter)
    assert not saliency_significant(fit)[0]
    found = procedure._fitted(fit, significant=False)
    for axis, truth in (("d", 99.6), ("q", 100.4)):
        parameter = bench.uncertainties.parameter(axis, "", found[axis], procedure="", section="", estimator="")
        low, high = parameter.coverage_interval
        assert low <= truth <= high
        assert "saliency that the scatter may hide" in {str(row.source) for row in parameter.budget}
