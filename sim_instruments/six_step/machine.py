"""The machine of a six-step drive as the motor of the virtual bench."""

import math

from sim_instruments.physics.hall import SimulatedHallSensors
from sim_instruments.physics.motor import VirtualMotor
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
