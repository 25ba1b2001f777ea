"""The files in the packages they are for: both give the torque and the voltage that λ, Ld, Lq and p say."""

import warnings
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from bench.plugins.catalogues import installed
from reports.exports.subject import Subject
from reports.exports.target import sheet_for
from tests.reports.exports.conftest import TRUTH

P, R, LD, LQ, FLUX = (
    TRUTH[name]
    for name in ("pole_pairs", "stator_resistance", "d_axis_inductance", "q_axis_inductance", "flux_linkage")
)
CURRENT = complex(-7.0, 20.0)
TORQUE = 1.5 * P * (FLUX + (LD - LQ) * CURRENT.real) * CURRENT.imag


def executed(name: str, subject: Subject) -> ModuleType:
    """The written file as a module."""
    target = installed().exports[name]
    module = ModuleType(f"exported_{target.name}")
    exec(compile(target.write(sheet_for(target, subject)), "exported.py", "exec"), module.__dict__)  # noqa: S102
    return module


def test_motulator(make_subject: Callable[..., Subject]) -> None:
    from motulator.drive import model

    machine = model.SynchronousMachine(executed("motulator", make_subject()).par)
    machine.state.psi_s = complex(LD * CURRENT.real + FLUX, LQ * CURRENT.imag)
    assert machine.i_s == pytest.approx(CURRENT, rel=1e-7)
    assert machine.tau_M == pytest.approx(TORQUE, rel=1e-7)
    # At standstill the flux grows by the voltage less the resistive drop.
    machine.inp.u_ss, machine.inp.w_M = complex(1.0, 2.0), 0.0
    machine.out.i_s = machine.i_s
    assert machine.rhs()[0] == pytest.approx(complex(1.0, 2.0) - R * CURRENT, rel=1e-7)


@pytest.mark.slow
def test_gym_electric_motor(make_subject: Callable[..., Subject]) -> None:
    with warnings.catch_warnings():
        # Its docstrings hold escapes that Python warns of on first compilation.
        warnings.simplefilter("ignore")
        from gym_electric_motor.physical_systems.electric_motors import PermanentMagnetSynchronousMotor

    parameter = executed("gym-electric-motor", make_subject()).motor_parameter
    motor = PermanentMagnetSynchronousMotor(motor_parameter=parameter)
    assert {name: motor.motor_parameter[name] for name in parameter} == parameter
    assert motor.motor_parameter["j_rotor"] == pytest.approx(TRUTH["inertia"])
    state = np.array([CURRENT.real, CURRENT.imag, 0.0])
    assert motor.torque(state) == pytest.approx(TORQUE, rel=1e-7)
    speed = 100.0
    derivative = motor.electrical_ode(state, [1.0, 2.0], speed)
    wanted_d = (1.0 - R * CURRENT.real + P * speed * LQ * CURRENT.imag) / LD
    wanted_q = (2.0 - R * CURRENT.imag - P * speed * (LD * CURRENT.real + FLUX)) / LQ
    assert derivative[:2] == pytest.approx([wanted_d, wanted_q], rel=1e-6)
