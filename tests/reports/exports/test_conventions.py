"""Published figures of real motors and projects' own constants: factors of 2, 1.5, √2, √3, 2π and pairs for poles."""

import math
from collections.abc import Callable

import pytest

from reports.exports import quantities as q
from reports.exports.subject import Datasheet, Subject

BLY172S_FLUX = 0.03279636 / (2.0 * math.pi)


def value(quantity: q.ExportQuantity, subject: Subject) -> float:
    return q.figure(quantity, subject.parameters, Datasheet()).value


@pytest.fixture
def motor(make_subject: Callable[..., Subject]) -> Callable[[float, float], Subject]:
    return lambda pairs, flux: make_subject({"pole_pairs": pairs, "flux_linkage": flux})


def test_anaheim_bly172s(motor: Callable[[float, float], Subject]) -> None:
    subject = motor(4.0, BLY172S_FLUX)
    assert pytest.approx(5.220e-3, rel=1e-4) == BLY172S_FLUX
    assert value(q.FLUX_PER_HERTZ, subject) == pytest.approx(0.03279636, rel=1e-12)
    assert value(q.EMF_PEAK_LINE, subject) == pytest.approx(3.787, rel=1e-4)


def test_teknic_m2310p_in_two_makers_files(motor: Callable[[float, float], Subject]) -> None:
    # TI's user.h has 0.0399353318 V/Hz, MathWorks' getPMSMParameters 4.64 V peak line-line per krpm: one motor, 4 pole pairs.
    subject = motor(4.0, 0.0399353318 / (2.0 * math.pi))
    assert value(q.EMF_PEAK_LINE, subject) == pytest.approx(4.64, rel=0.01)


def test_mathworks_own_relation(motor: Callable[[float, float], Subject]) -> None:
    # BLY171D: p = 4, Ke = 3.8 gives FluxPM = 0.0052; T_rated = 0.0566 N·m at I_rated = 1.8 A is 1.5·p·FluxPM·I_rated.
    subject = motor(4.0, 3.8 / (math.sqrt(3.0) * 2.0 * math.pi * 1000.0 * 4.0 / 60.0))
    assert value(q.FLUX_LINKAGE, subject) == pytest.approx(0.0052, abs=5e-5)
    assert 1.8 * value(q.TORQUE_CONSTANT, subject) == pytest.approx(0.0566, abs=5e-5)


@pytest.mark.parametrize(("pairs", "flux"), [(1.0, 0.1), (7.0, 2.9e-3), (21.0, 4.4e-3)])
def test_odrives_constants_between_kv_torque_and_flux(
    pairs: float, flux: float, motor: Callable[[float, float], Subject]
) -> None:
    subject = motor(pairs, flux)
    kv = value(q.KV, subject)
    assert value(q.TORQUE_CONSTANT, subject) == pytest.approx(8.27 / kv, rel=1e-4)
    assert flux == pytest.approx(5.51328895422 / (pairs * kv), rel=1e-9)


def test_rms_is_peak_over_root_two(motor: Callable[[float, float], Subject]) -> None:
    subject = motor(4.0, 8.5e-3)
    assert value(q.EMF_PEAK_LINE, subject) / value(q.EMF_RMS_LINE, subject) == pytest.approx(math.sqrt(2.0))


def test_poles_are_twice_the_pairs(motor: Callable[[float, float], Subject]) -> None:
    assert value(q.POLES, motor(7.0, 1e-3)) == 14.0
