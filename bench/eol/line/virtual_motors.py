"""The virtual motors of a batch: a type's motor with the spread of its making, and a defect here and there."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from bench.eol.plan import SpreadSection
from sim_instruments.physics.motor import VirtualMotor


def seed_of(*parts: object) -> int:
    """Return a seed that follows from these parts, the same on every machine."""
    return int.from_bytes(hashlib.sha256("\0".join(map(str, parts)).encode()).digest()[:8], "big")


def drawn_motor(nominal: VirtualMotor, spread: SpreadSection, seed: int) -> tuple[VirtualMotor, str]:
    """Return one motor of the type and its defect's name, empty for a sound one; the same for the same seed.

    What is drawn is normally distributed; the three windings share half of the resistance's variance, as wire of one reel.
    """
    random = np.random.default_rng(seed)

    def factor(per_cent: float) -> float:
        return float(np.exp(0.01 * per_cent * random.standard_normal()))

    wire = factor(spread.resistance / np.sqrt(2.0))
    own = [factor(spread.resistance / np.sqrt(2.0)) for _ in range(3)]
    inductance, saliency = factor(spread.inductance), factor(0.3 * spread.inductance)
    flux, inertia, friction = factor(spread.flux), factor(spread.inertia), factor(spread.friction)
    a, b, c = (r * wire * each for r, each in zip(nominal.phase_resistances, own, strict=True))
    motor = replace(
        nominal,
        phase_resistances=(a, b, c),
        d_axis_inductance=nominal.d_axis_inductance * inductance / saliency,
        q_axis_inductance=nominal.q_axis_inductance * inductance * saliency,
        flux_linkage=nominal.flux_linkage * flux,
        inertia=nominal.inertia * inertia,
        coulomb_friction=nominal.coulomb_friction * friction,
        viscous_friction=nominal.viscous_friction * friction,
    )
    if random.random() >= spread.defects:
        return motor, ""
    name = list(DEFECTS)[int(random.integers(len(DEFECTS)))]
    return DEFECTS[name](motor), name


def _joint(motor: VirtualMotor) -> VirtualMotor:
    a, b, c = motor.phase_resistances
    return replace(motor, phase_resistances=(a, b * 1.25, c))


def _turns(motor: VirtualMotor) -> VirtualMotor:
    """Take a tenth of the turns off all phases: R goes with the turns, L with their square."""
    a, b, c = motor.phase_resistances
    return replace(
        motor,
        phase_resistances=(0.9 * a, 0.9 * b, 0.9 * c),
        d_axis_inductance=0.81 * motor.d_axis_inductance,
        q_axis_inductance=0.81 * motor.q_axis_inductance,
        flux_linkage=0.9 * motor.flux_linkage,
    )


#: By name: what it makes of a motor.
DEFECTS: Mapping[str, Callable[[VirtualMotor], VirtualMotor]] = {
    "a bad joint in phase B": _joint,
    "a tenth of the turns missing": _turns,
    "weak magnets": lambda motor: replace(motor, flux_linkage=0.88 * motor.flux_linkage),
    "a tight bearing": lambda motor: replace(
        motor, coulomb_friction=4.0 * motor.coulomb_friction, viscous_friction=3.0 * motor.viscous_friction
    ),
}
