"""One random motor on a bench of random instruments: every procedure, and how far each figure is from the truth."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from time import process_time
from types import MappingProxyType
from typing import Any

import numpy as np

from bench.journal.waveforms import StoredRecord, WaveformLike
from bench.operators.virtual import VirtualOperator
from bench.plugins.catalogues import installed
from bench.run.plan import Planned, make_plan
from bench.safety.limits.bounds import known_pole_pairs
from bench.safety.shutdown import shut_down
from bench.safety.station_instruments import StationInstruments
from bench.station.shutdown_sequence import ShutdownSequence
from bench.station.visa_library import StationVisa
from bench.virtual.true_values import true_values
from bench.virtual.virtual_station import virtual_station
from drivers.interfaces import InstrumentError
from procedures.core.bench import Bench, ProcedureError
from procedures.core.events import Event
from procedures.core.nameplate import Nameplate
from procedures.core.parameter_set import merge
from procedures.core.parameters import PARAMETERS
from procedures.core.result import Parameter, ProcedureResult
from procedures.estimation.fitting.fit import EstimationError
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.instruments.errors import Errors
from tests.studies.worlds.random_motors import draw_motor

#: The load cycle of equivalent resistance is another kind of run; the data sheet's figures are not measured.
LEFT_OUT = ("nameplate", "equivalent-resistance")
#: Half-width (K) within which the virtual operator's thermometer reads the winding.
THERMOMETER = 0.5
_TEMPERATURE = "temperature_uncertainty"


@dataclass(frozen=True)
class Figure:
    """One figure of one motor: measured value, truth, standard uncertainty and coverage interval, in the parameter's unit."""

    procedure: str
    name: str
    value: float
    truth: float
    uncertainty: float
    low: float
    high: float


@dataclass(frozen=True)
class Measured:
    """What a motor gave: its figures, and by procedure why one was refused or failed."""

    index: int
    figures: tuple[Figure, ...]
    refused: tuple[tuple[str, str], ...]
    failed: tuple[tuple[str, str], ...]


class NoRecord:
    """A journal and a store of waveforms that keep nothing."""

    def record(self, event: Event) -> None:
        """Let it go."""

    def store(self, name: str, waveforms: Mapping[str, WaveformLike]) -> StoredRecord:
        """Let it go."""
        return StoredRecord(name, "", 0)


def study_plan(procedures: Collection[str] = (), choices: Mapping[str, object] = MappingProxyType({})) -> list[Planned]:
    """Return the procedures of the study in the catalogue's order, or those of them that are named; `choices` are settings of those
    that have them.
    """
    known = installed().procedures
    names = [
        name for name in known if (name in procedures if procedures else name not in LEFT_OUT and known[name].in_all())
    ]
    wanted = {_TEMPERATURE: THERMOMETER, **choices}
    takers = [known[name].settings_type().model_fields for name in names]
    settings = [f"{name}={value}" for name, value in wanted.items() if any(name in fields for fields in takers)]
    return make_plan(names, settings, known)


def measure(
    seed: int,
    index: int,
    plan: list[Planned],
    spent: Counter[str] | None = None,
    put_right: Callable[[VirtualBench, Nameplate], None] | None = None,
) -> Measured:
    """Draw motor `index` of the study with this seed and measure it; depends on nothing else.

    `spent` sums up the processor time (s) by procedure. With `put_right`, which does what only a person may, the instruments
    begin as a last user may have left them.
    """
    random = np.random.default_rng([seed, index])
    motor, plate = draw_motor(random)
    ambient = float(random.uniform(18.0, 28.0))
    bench = VirtualBench(
        motor,
        seed=int(random.integers(1 << 31)),
        errors=Errors.drawn(random),
        setting=BenchSetting(ambient_temperature=ambient, initial_angle=float(random.uniform(0.0, 2.0 * np.pi))),
        sockets=False,
        hostile=None if put_right is None else index,
    )
    with bench:
        if put_right is not None:
            put_right(bench, plate)
        done = carry_out(bench, plate, int(random.integers(1 << 31)), plan, spent)
    truth = true_values(PARAMETERS, motor)
    figures = [figure(p, truth) for result in done.results for p in result.parameters if p.name in truth]
    return Measured(index, tuple(figures), tuple(done.refused), tuple(done.failed))


@dataclass(frozen=True)
class Done:
    """What procedures gave on one bench; those that gave nothing with the reason, refused ones and failed ones."""

    results: list[ProcedureResult]
    refused: list[tuple[str, str]]
    failed: list[tuple[str, str]]


def carry_out(
    virtual: VirtualBench,
    plate: Nameplate,
    seed: int,
    plan: list[Planned],
    spent: Counter[str] | None = None,
    drive: Mapping[str, Any] | None = None,
) -> Done:
    """Carry procedures out, one after the other; `seed` is the operator's, `spent` sums up processor time (s), `drive` has the ratings of
    the bench's inverter where that regulates d and q currents.
    """
    nothing = NoRecord()
    results: list[ProcedureResult] = []
    instruments = opened_by(virtual, plate, lambda: known_pole_pairs(plate, merge(results).parameters), drive)
    refused, failed = [], []
    try:
        bench = Bench(instruments.available(), VirtualOperator(virtual.world, seed), virtual.clock, nothing)
        for planned in plan:
            known, begun = merge(results).parameters, process_time()
            try:
                results.append(planned.procedure(bench, plate, planned.settings, known).run())
            except (ProcedureError, EstimationError, InstrumentError) as reason:
                refused.append((planned.name, _kind(reason)))
                shut_down(ShutdownSequence(), instruments.opened(), nothing, virtual.clock)
            except Exception as fault:  # noqa: BLE001  it is counted, and the study goes on
                failed.append((planned.name, f"{type(fault).__name__}: {_kind(fault)}"))
                shut_down(ShutdownSequence(), instruments.opened(), nothing, virtual.clock)
            if spent is not None:
                spent[planned.name] += process_time() - begun
    finally:
        failed += [("close", fault) for fault in instruments.close()]
    return Done(results, refused, failed)


def opened_by(
    virtual: VirtualBench,
    plate: Nameplate,
    pole_pairs: Callable[[], int | None] = lambda: None,
    drive: Mapping[str, Any] | None = None,
) -> StationInstruments:
    """Return the instruments of a bench as a station has them, behind the limits of a plate."""
    nothing = NoRecord()
    return StationInstruments(
        virtual_station(virtual.addresses(), drive),
        plate,
        virtual.clock,
        nothing,
        nothing,
        StationVisa(virtual.visa_library),
        lambda _: None,
        in_process=virtual,
        pole_pairs=pole_pairs,
    )


def figure(parameter: Parameter, truth: Mapping[str, float]) -> Figure:
    """Return a parameter beside its true value, by what it is measured."""
    way = parameter.procedure
    if parameter.name == "torque_constant":
        way += ", derived" if parameter.estimator.startswith("1.5") else ", measured"
    return Figure(
        way,
        parameter.name,
        parameter.value,
        truth[parameter.name],
        parameter.standard_uncertainty,
        *parameter.coverage_interval,
    )


def _kind(reason: Exception) -> str:
    """Return the sentence without its figures, so that like reasons count together."""
    if isinstance(reason, ProcedureError):
        return reason.text.template
    return re.sub(r"[-+−]?\d[\d.,]*(e[-+]?\d+)?", "#", str(reason))
