import math
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bench.plugins.catalogues import installed
from procedures.core.result import Parameter
from reports.exports import quantities as q
from reports.exports.subject import Datasheet, Subject
from reports.exports.target import sheet_for

shared = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)


def figure(quantity: q.ExportQuantity, subject: Subject) -> q.ExportFigure:
    return q.figure(quantity, subject.parameters, Datasheet())


@shared
@given(relative=st.floats(1e-5, 0.02), gain=st.floats(1e-4, 0.05))
def test_a_gain_that_both_inductances_share(relative: float, gain: float, make_subject: Callable[..., Subject]) -> None:
    subject = make_subject(relative=relative, gain=gain)
    d, axis_q = subject.parameters["d_axis_inductance"], subject.parameters["q_axis_inductance"]
    common = gain / math.sqrt(3.0)
    own = math.hypot(relative * d.value, relative * axis_q.value)
    difference = figure(q.INDUCTANCE_DIFFERENCE, subject)
    mean = figure(q.MEAN_INDUCTANCE, subject)
    assert difference.standard_uncertainty == pytest.approx(
        math.hypot(own, common * (axis_q.value - d.value)), rel=1e-6
    )
    assert mean.standard_uncertainty == pytest.approx(math.hypot(0.5 * own, common * mean.value), rel=1e-6)


@shared
@given(relative=st.floats(1e-5, 0.04))
def test_one_parameter_keeps_its_relative_uncertainty(relative: float, make_subject: Callable[..., Subject]) -> None:
    subject = make_subject(relative=relative)
    for quantity in (q.KV, q.TORQUE_CONSTANT, q.FLUX_PER_HERTZ, q.EMF_PEAK_LINE, q.EMF_RMS_LINE, q.FLUX_LINKAGE):
        made = figure(quantity, subject)
        assert made.standard_uncertainty / made.value == pytest.approx(relative, rel=1e-9)
        low, high = made.coverage_interval
        assert low < made.value < high
        assert (high - made.value) / made.standard_uncertainty == pytest.approx(1.96, abs=0.01)


def test_figures_without_saliency_have_no_difference(
    make_subject: Callable[..., Subject], replaced: Callable[..., dict[str, Parameter]]
) -> None:
    parameters = replaced("inertia")
    parameters["q_axis_inductance"] = parameters["d_axis_inductance"]
    sheet = sheet_for(installed().exports["vesc"], make_subject(parameters=parameters))
    line = sheet.line("foc_motor_ld_lq_diff")
    assert line.figure.value == 0.0
    assert line.figure.standard_uncertainty == pytest.approx(0.0, abs=1e-12)


def test_the_json_file_holds_the_correlation(make_subject: Callable[..., Subject]) -> None:
    import json

    subject = make_subject(relative=1e-4, gain=0.01)
    made = json.loads(installed().exports["json"].write(sheet_for(installed().exports["json"], subject)))
    coefficient = made["correlations"]["d_axis_inductance"]["q_axis_inductance"]
    assert coefficient == pytest.approx(1.0 / (1.0 + 3.0 * 1e-4), rel=1e-6)
    assert list(made["correlations"]) == ["d_axis_inductance"]
