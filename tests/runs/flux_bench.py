"""A virtual bench for motors on a flux map: an inverter and a dynamometer as large as the motor, and its station."""

from dataclasses import replace

import numpy as np

from bench.operators.virtual import VirtualOperator
from bench.plugins.catalogues import installed
from bench.run.plan import make_plan
from bench.safety.station_instruments import StationInstruments
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import dq_inverter_for, virtual_station
from procedures.core.bench import Bench
from procedures.core.live_plot import RunObserver
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.result import ProcedureResult
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.catalogue import standard_units
from sim_instruments.instruments.errors import Errors
from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.iron import Iron
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.studies.worlds.measured_motor import NoRecord

#: The measured motor's plate: 400 rpm are a quarter of its speed.
BALDOR = Nameplate(
    "Baldor",
    WindingConnection.WYE,
    rated_current=20.0,
    maximum_current=22.0,
    rated_speed_rpm=1600.0,
    rated_voltage=600.0,
    pole_pairs=2,
)


def motor_on(
    flux_map: FluxMap, *, resistance: float = 0.6, pole_pairs: int = 2, iron: Iron | None = None
) -> VirtualMotor:
    """A motor that links what a map says."""
    return VirtualMotor(
        "wye",
        (resistance, resistance, resistance),
        1e-3,
        1e-3,
        flux_map.flux_linkage,
        pole_pairs,
        inertia=0.015,
        coulomb_friction=0.2,
        viscous_friction=1e-3,
        thermal_resistance=0.5,
        thermal_time_constant=600.0,
        flux_map=flux_map,
        iron=iron or Iron(),
    )


def flux_bench(
    motor: VirtualMotor,
    plate: Nameplate,
    *,
    seed: int = 1,
    errors: Errors | None = None,
    setting: BenchSetting | None = None,
    torque: float = 100.0,
) -> VirtualBench:
    """A bench whose inverter has room for the plate's voltage and current, its dynamometer for a torque (N·m)."""
    units = {unit.kind.role: unit for unit in standard_units(dq_inverter=dq_inverter_for(plate))}
    units["dynamometer"] = replace(units["dynamometer"], options={"maximum_torque": torque, "maximum_speed": 630.0})
    return VirtualBench(motor, list(units.values()), seed=seed, errors=errors, setting=setting, sockets=False)


def map_of(
    virtual: VirtualBench, plate: Nameplate, *settings: str, name: str = "flux-map", onlooker: RunObserver | None = None
) -> ProcedureResult:
    """Run a procedure on it, by the real drivers; `onlooker` is shown the plots."""
    nothing = NoRecord()
    instruments = StationInstruments(
        virtual_station(virtual.addresses(), dq_inverter_for(plate)),
        plate,
        virtual.clock,
        nothing,
        nothing,
        StationVisa(virtual.visa_library),
        lambda _: None,
        in_process=virtual,
        pole_pairs=lambda: plate.pole_pairs,
    )
    (planned,) = make_plan([name], settings, installed().procedures)
    try:
        operator = VirtualOperator(virtual.world, 1)
        bench = Bench(instruments.available(), operator, virtual.clock, nothing, onlooker=onlooker)
        return planned.procedure(bench, plate, planned.settings, {}).run()
    finally:
        instruments.close()


def errors_of(result: ProcedureResult, truth: FluxMap) -> tuple[np.ndarray, np.ndarray]:
    """What the measured points are off by, (n, 2) in V·s, and their standard uncertainties."""
    table = {name: np.array(column) for name, column in result.findings["tables"]["flux_map.csv"].items()}
    true = np.column_stack(truth.flux(table["id_A"], table["iq_A"]))
    found = np.column_stack((table["psi_d_Vs"], table["psi_q_Vs"]))
    return found - true, np.column_stack((table["u_psi_d_Vs"], table["u_psi_q_Vs"]))
