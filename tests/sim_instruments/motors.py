"""Motors that tests of more than one folder turn."""

from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive

BENCH_MOTOR = VirtualMotor(
    connection="wye",
    phase_resistances=(0.5, 0.5, 0.5),
    d_axis_inductance=1.0e-3,
    q_axis_inductance=1.5e-3,
    flux_linkage=0.02,
    pole_pairs=4,
    inertia=1.0e-4,
    coulomb_friction=0.01,
    viscous_friction=1.0e-5,
)

#: The document's 92BL-30-25L.
SIX_STEP = SixStepDrive(
    connection="delta",
    resistance=0.1146,
    self_inductance=0.412e-3,
    mutual_inductance=-0.0233e-3,
    emf_constant=0.0613,
    pole_pairs=4,
    source_voltage=24.32,
    source_resistance=0.124,
    switch_resistance=0.03,
    diode_drop=0.7,
    inertia=1.17e-4,
    coulomb_friction=0.0349,
    viscous_friction=7.941e-6,
)
