"""The machine of a six-step drive as the motor of the virtual bench."""

import math
from dataclasses import replace

from sim_instruments.physics.motor.hall import SimulatedHallSensors
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive


def virtual_motor(drive: SixStepDrive) -> VirtualMotor:
    """Return the drive's machine as a motor without saliency, so that one file serves drive and bench.

    d- and q-axis inductance are L11 − L12, the zero-sequence one is L11 + 2·L12, the flux linkage is the EMF constant
    over the pole pairs. The bench counts a harmonic's phase from the d axis, the drive from the EMF's peak. The Hall sensors
    are those that the drive commutates by.
    """
    inductance = drive.self_inductance - drive.mutual_inductance
    return VirtualMotor(
        connection=drive.connection,
        phase_resistances=(drive.resistance, drive.resistance, drive.resistance),
        d_axis_inductance=inductance,
        q_axis_inductance=inductance,
        zero_sequence_inductance=drive.self_inductance + 2 * drive.mutual_inductance,
        flux_linkage=drive.emf_constant / drive.pole_pairs,
        flux_harmonics=tuple(
            (h.order, h.amplitude, h.phase + (h.order - 1) * math.pi / 2) for h in drive.emf_harmonics
        ),
        pole_pairs=drive.pole_pairs,
        inertia=drive.inertia,
        coulomb_friction=drive.coulomb_friction,
        viscous_friction=drive.viscous_friction,
        halls=SimulatedHallSensors(offset=-drive.advance_angle),
    )


def driven(drive: SixStepDrive, motor: VirtualMotor) -> tuple[SixStepDrive, VirtualMotor]:
    """Return the same bridge and source on a machine with a motor's figures, and the motor with that machine's, to the last digit.

    Raises ValueError for unlike windings or magnets.
    """
    mutual = (motor.winding_zero_sequence_inductance - motor.q_axis_inductance) / 3.0
    even = any(order % 2 == 0 for order, _, _ in motor.flux_harmonics)
    unlike = len({*motor.phase_resistances}) > 1 or len({*motor.turn_shares}) > 1 or len({*motor.emf_shares}) > 1
    if unlike or even or motor.shorted_turns is not None or motor.d_axis_inductance != motor.q_axis_inductance:
        raise ValueError("a six-step drive's machine has three windings alike and magnets alike")
    made = replace(
        drive,
        resistance=motor.phase_resistances[0],
        self_inductance=motor.q_axis_inductance + mutual,
        mutual_inductance=mutual,
        emf_constant=motor.flux_linkage * motor.pole_pairs,
        pole_pairs=motor.pole_pairs,
        inertia=motor.inertia,
        coulomb_friction=motor.coulomb_friction,
        viscous_friction=motor.viscous_friction,
    )
    machine = virtual_motor(made)
    return made, replace(
        motor,
        d_axis_inductance=machine.d_axis_inductance,
        q_axis_inductance=machine.q_axis_inductance,
        flux_linkage=machine.flux_linkage,
    )
