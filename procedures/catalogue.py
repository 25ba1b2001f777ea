"""The procedures by name, in the order in which a whole measurement takes them; the end-of-line checks come last."""

from collections.abc import Mapping
from typing import Any

from procedures.back_emf_constant import BackEmfConstant
from procedures.back_emf_shape import BackEmfShape
from procedures.cogging_torque import CoggingTorque
from procedures.dq_inductance_aligned import DqInductanceAligned
from procedures.dq_inductance_extremes import DqInductanceExtremes
from procedures.dq_inductance_time_constant import DqInductanceTimeConstant
from procedures.equivalent_resistance import EquivalentResistance
from procedures.hall_sensors import HallSensors
from procedures.inertia import Inertia
from procedures.insulation_resistance import InsulationResistance
from procedures.nameplate_data import NameplateData
from procedures.no_load_current import NoLoadCurrent
from procedures.no_load_current_six_step import NoLoadCurrentSixStep
from procedures.phase_order import PhaseOrder
from procedures.pole_pairs_back_emf import PolePairsBackEmf
from procedures.pole_pairs_inverter import PolePairsInverter
from procedures.pole_pairs_static import PolePairsStatic
from procedures.procedure import Procedure
from procedures.stator_resistance import StatorResistance
from procedures.stator_resistance_dc import StatorResistanceDc
from procedures.torque_constant import TorqueConstant
from procedures.winding_balance import WindingBalance

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
