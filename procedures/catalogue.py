"""The procedures by name, in the order in which a whole measurement takes them; the end-of-line checks come last."""

from collections.abc import Mapping
from typing import Any

from procedures.core.procedure import Procedure
from procedures.end_of_line.back_emf_shape import BackEmfShape
from procedures.end_of_line.cogging_torque import CoggingTorque
from procedures.end_of_line.hall_sensors import HallSensors
from procedures.end_of_line.insulation_resistance import InsulationResistance
from procedures.end_of_line.no_load_current import NoLoadCurrent
from procedures.end_of_line.no_load_current_six_step import NoLoadCurrentSixStep
from procedures.end_of_line.phase_order import PhaseOrder
from procedures.end_of_line.winding_balance import WindingBalance
from procedures.note.back_emf_constant import BackEmfConstant
from procedures.note.dq_inductance_aligned import DqInductanceAligned
from procedures.note.dq_inductance_extremes import DqInductanceExtremes
from procedures.note.dq_inductance_time_constant import DqInductanceTimeConstant
from procedures.note.inertia import Inertia
from procedures.note.nameplate import NameplateData
from procedures.note.pole_pairs_back_emf import PolePairsBackEmf
from procedures.note.pole_pairs_inverter import PolePairsInverter
from procedures.note.pole_pairs_static import PolePairsStatic
from procedures.note.stator_resistance import StatorResistance
from procedures.note.stator_resistance_dc import StatorResistanceDc
from procedures.note.torque_constant import TorqueConstant
from procedures.six_step.equivalent_resistance import EquivalentResistance

_ORDER: tuple[type[Procedure[Any]], ...] = (
    NameplateData,
    PolePairsStatic,
    StatorResistance,
    StatorResistanceDc,
    DqInductanceExtremes,
    DqInductanceAligned,
    DqInductanceTimeConstant,
    PolePairsInverter,
    PolePairsBackEmf,
    BackEmfConstant,
    Inertia,
    TorqueConstant,
    EquivalentResistance,
    WindingBalance,
    PhaseOrder,
    BackEmfShape,
    NoLoadCurrent,
    NoLoadCurrentSixStep,
    CoggingTorque,
    HallSensors,
    InsulationResistance,
)


def catalogue() -> Mapping[str, type[Procedure[Any]]]:
    """Return every procedure by its name."""
    return {procedure.name: procedure for procedure in _ORDER}
