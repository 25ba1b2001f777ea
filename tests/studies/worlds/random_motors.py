"""Random motors that could be built, and that the virtual station can measure."""

import math

import numpy as np

from procedures.core.nameplate import Nameplate, WindingConnection
from sim_instruments.physics.motor.motor import VirtualMotor

#: What the virtual station gives: the supply's voltage (V) with a reserve, the phase voltage of the inverter (V, peak), its
#: highest frequency (Hz), the dynamometer's speed (rad/s) and torque (N·m).
_SUPPLY_VOLTAGE, _PHASE_VOLTAGE, _FREQUENCY, _SPEED, _TORQUE = 5.5, 24.0, 900.0, 600.0, 4.0
#: Between two lines lie two phases, and their unbalance.
_LINE_TO_LINE = 2.1
_HOT = 80.0


def draw_motor(random: np.random.Generator) -> tuple[VirtualMotor, Nameplate]:
    """Return a motor and its plate.

    R (10 mΩ – 20 Ω), the electrical time constant (0.1 – 20 ms, L within 10 µH – 50 mH), Lq/Ld (1 – 3), pole pairs (1 – 24),
    connection, unbalance (± 3 %), harmonics and friction are drawn; current, speed, flux and inertia are drawn within what such
    a motor and the station allow: the voltage suffices at rated speed, rated loss warms the winding by about 80 K.
    """
    connection = random.choice(["wye", "delta"])
    resistance = _log(random, 0.010, 20.0)
    mean = float(np.clip(resistance * _log(random, 1e-4, 20e-3), 10e-6, 50e-3))
    saliency = random.uniform(1.0, 3.0)
    ld, lq = 2.0 * mean / (1.0 + saliency), 2.0 * mean * saliency / (1.0 + saliency)
    pairs = int(random.integers(1, 25))
    current = min(_log(random, 1.0, 50.0), _SUPPLY_VOLTAGE / (_LINE_TO_LINE * (resistance + 0.01)))
    emf = random.uniform(0.25, 0.7) * _PHASE_VOLTAGE
    # At rated speed the inductance may take no more of the voltage than the EMF does.
    electrical = min(2.0 * math.pi * _FREQUENCY, emf / (lq * current), pairs * _SPEED)
    electrical *= random.uniform(0.4, 1.0)
    flux = emf / electrical
    torque = 1.5 * pairs * flux * current
    if torque > _TORQUE:
        current *= _TORQUE / torque
        torque = _TORQUE
    speed = electrical / pairs
    inertia = float(np.clip(torque * _log(random, 0.02, 0.3) / speed, 5e-7, 4e-3))
    # What the supply can align with must hold the rotor against its friction.
    holding = torque * min(1.0, 10.0 / current)
    coulomb = holding * random.uniform(0.002, 0.02)
    loss = 1.5 * resistance * current**2
    ratio = 3.0 if connection == "delta" else 1.0
    motor = VirtualMotor(
        connection="delta" if connection == "delta" else "wye",
        phase_resistances=_unbalanced(random, ratio * resistance),
        d_axis_inductance=ratio * ld,
        q_axis_inductance=ratio * lq,
        flux_linkage=math.sqrt(ratio) * flux,
        pole_pairs=pairs,
        inertia=inertia,
        flux_harmonics=tuple(
            (order, random.uniform(0.0, largest), random.uniform(-math.pi, math.pi))
            for order, largest in ((5, 0.05), (7, 0.03), (11, 0.01))
        ),
        coulomb_friction=coulomb,
        viscous_friction=coulomb / speed * random.uniform(0.05, 1.0),
        cogging_torque=holding * random.uniform(0.0, 0.005),
        cogging_order=6 * pairs,
        thermal_resistance=_HOT / loss,
        thermal_time_constant=_log(random, 300.0, 2000.0),
    )
    plate = Nameplate(
        name="drawn",
        connection=WindingConnection(motor.connection),
        rated_current=current,
        maximum_current=2.0 * current,
        rated_speed_rpm=speed * 30.0 / math.pi,
        rated_voltage=math.sqrt(3.0) * emf,
        maximum_speed_rpm=1.2 * speed * 30.0 / math.pi,
    )
    return motor, plate


def _log(random: np.random.Generator, low: float, high: float) -> float:
    return math.exp(random.uniform(math.log(low), math.log(high)))


def _unbalanced(random: np.random.Generator, resistance: float) -> tuple[float, float, float]:
    a, b, c = resistance * (1.0 + random.uniform(-0.03, 0.03, 3))
    return float(a), float(b), float(c)
