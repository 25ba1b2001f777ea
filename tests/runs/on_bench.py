"""One procedure at a time on a virtual bench that a test has prepared, through the real drivers."""

from collections.abc import Callable, Mapping
from typing import Any

from bench.operators.virtual import VirtualOperator
from bench.plugins.catalogues import installed
from bench.run.plan import make_plan
from bench.safety.station_instruments import StationInstruments
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import Instrument
from procedures.core.bench import Bench, Operator, Role
from procedures.core.live_plot import RunObserver
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.result import Parameter, ProcedureResult
from sim_instruments.bench import VirtualBench
from tests.studies.worlds.measured_motor import NoRecord


def measure(
    virtual: VirtualBench,
    plate: Nameplate,
    name: str,
    *settings: str,
    known: Mapping[str, Parameter] | None = None,
    hands: Callable[[dict[Role, Instrument], Operator], Operator] = lambda _, operator: operator,
    onlooker: RunObserver | None = None,
    run: Callable[[Procedure[Any]], ProcedureResult] = lambda procedure: procedure.run(),
) -> ProcedureResult:
    """Run a procedure with settings as `--set` has them; the bench is left switched off.

    `hands` may put others in place of instruments, and returns who is the operator; `onlooker` is shown the plots,
    `run` may run it otherwise.
    """
    record: Any = NoRecord()
    instruments = StationInstruments(
        virtual_station(virtual.addresses()),
        plate,
        virtual.clock,
        record,
        record,
        StationVisa(virtual.visa_library),
        lambda _: None,
        in_process=virtual,
    )
    (planned,) = make_plan([name], settings, installed().procedures)
    try:
        available = dict(instruments.available())
        operator = hands(available, VirtualOperator(virtual.world, 1))
        bench = Bench(available, operator, virtual.clock, record, onlooker=onlooker)
        return run(planned.procedure(bench, plate, planned.settings, known or {}))
    finally:
        instruments.close()


def within(parameter: Parameter, truth: float, multiple: float = 3.0) -> bool:
    """Tell whether a parameter holds a truth within so many of its standard uncertainties."""
    return abs(parameter.value - truth) <= multiple * parameter.standard_uncertainty
