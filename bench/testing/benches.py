"""Virtual benches for a user's tests: as the line has them, or with direct access to every instrument."""

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from bench.eol.line.workers.virtual_socket import SocketMotors, Specimen, VirtualSocket
from bench.eol.plan_file import SpreadSection
from bench.files.toml_file import nearest
from bench.i18n.errors import InputError
from bench.motor.motor_file import MotorFile
from bench.plugins.catalogues import installed
from bench.rehearsal.counterparts import counterparts_of
from bench.run.console import console_on
from bench.run.context import RunContext, run_context
from bench.run.plan import Catalogue
from bench.run.request import RunRequest
from bench.safety.interrupts import Interrupts
from bench.station.sharing import NotShared
from bench.station.station_file import VIRTUAL, Station
from bench.study.twin import twin_of
from bench.virtual.disturbance_file import load_disturbances
from bench.virtual.fault_file import given_faults
from bench.virtual.fault_hooks import inject
from bench.virtual.true_values import true_values
from drivers.interfaces.text import text
from procedures.known_parameters import known_parameters
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.catalogue import FIXTURE, SimulatedUnit, find, standard_units
from sim_instruments.instruments.errors import Errors
from sim_instruments.six_step.drive import SixStepDrive

if TYPE_CHECKING:
    from pyvisa.resources import MessageBasedResource


@dataclass(frozen=True)
class RequestedBench:
    """The virtual bench that a test uses.

    `station` is a station file, whose drivers then work with their simulated instruments, or `virtual`; `operator` is virtual
    (hands), fixture, or empty for a line's usual one. With `drawn_errors`, as on a line, instruments err within their data sheets.
    """

    station: str = VIRTUAL
    operator: str = ""
    disturbances: Path | None = None
    drawn_errors: bool = False

    def procedures(self) -> Catalogue:
        """Return all procedures, including those of the station file. Raises InputError for a bad file."""
        twin = self._twin()
        return (twin.catalogues if twin else installed()).procedures

    @contextmanager
    def context(self, request: RunRequest, interrupts: Interrupts) -> Iterator[RunContext]:
        """Give the context for a run. Raises InputError for a bad file."""
        if self.station == VIRTUAL and not self.drawn_errors:
            with run_context(request, console_on(io.StringIO()), interrupts) as context:
                yield context
            return
        disturbances = None if self.disturbances is None else load_disturbances(self.disturbances)
        motors = SocketMotors(request.motor, SpreadSection(), request.seed, self.operator)
        socket = VirtualSocket(motors, 0, (), self._twin())
        faults = tuple(fault.described for fault in request.faults)
        specimen = Specimen(faults=faults, disturbances=disturbances)
        with socket.context("V", request.seed, lambda _: None, lambda _: NotShared(), specimen) as context:
            yield context

    def _twin(self) -> Station | None:
        return twin_of(self.station)


class BenchUnderTest:
    """A virtual bench in this process, for a user's driver: instruments by address, the simulated world, and its true values.

    `station` is a file whose instruments' simulated ones stand there, `options` what a station file says of an instrument, by
    role; `drive` another six-step drive than the motor file's. Raises InputError for a role that there is not.
    """

    def __init__(
        self,
        motor: MotorFile,
        seed: int,
        faults: Sequence[str],
        *,
        fixture: bool = False,
        station: Path | str = VIRTUAL,
        drive: SixStepDrive | None = None,
        options: Mapping[str, Mapping[str, Any]] | None = None,
        disturbances: Path | str | None = None,
        drawn_errors: bool = False,
    ) -> None:
        self._open = ExitStack()
        nominal, six_step = motor.virtual_motor(), drive or motor.six_step
        setting = None
        if disturbances is not None:
            setting = BenchSetting(disturbances=load_disturbances(Path(disturbances)))
        self.bench = self._open.enter_context(
            VirtualBench(
                nominal,
                _units(str(station), options or {}, six_step=six_step is not None, fixture=fixture),
                seed=seed,
                errors=Errors.drawn(np.random.default_rng(seed), fixture=fixture) if drawn_errors else None,
                six_step=six_step,
                sockets=False,
                fixture=fixture,
                setting=setting,
            )
        )
        self.truth = true_values(known_parameters(), nominal, six_step)
        self.inject(*faults)

    def inject(self, *faults: str) -> None:
        """Inject faults, each stated in a few words like "supply: silence at 12". Raises InputError for words that state no fault."""
        inject(given_faults(None, faults), self.bench.injector.add)

    def resource(self, role: str, **options: Any) -> "MessageBasedResource":
        """Open the instrument of a role by PyVISA, as its maker's manual has it; closed at the bench's end."""
        from pyvisa import ResourceManager

        addresses = {name: where for name, where in self.bench.addresses().items() if "::" in str(where)}
        if role not in addresses:
            raise InputError(
                text(
                    "there is no instrument {role!r} with a VISA address: {hint}",
                    role=role,
                    hint=nearest(role, list(addresses)),
                )
            )
        opened = ResourceManager(self.bench.visa_library).open_resource(str(addresses[role]), **options)
        self._open.callback(opened.close)
        return cast("MessageBasedResource", opened)

    def close(self) -> None:
        """Close what was opened."""
        self._open.close()


def _units(
    reference: str, options: Mapping[str, Mapping[str, Any]], *, six_step: bool, fixture: bool
) -> list[SimulatedUnit]:
    station = twin_of(reference)
    units = list(standard_units(six_step=six_step, fixture=fixture))
    if station is not None:
        units = [each.unit for each in counterparts_of(station).values()]
        units += [SimulatedUnit(find(name)) for name in FIXTURE.values()] if fixture else []
    roles = [unit.kind.role for unit in units]
    for role in options:
        if role not in roles:
            raise InputError(
                text("options: there is no instrument {role!r}: {hint}", role=role, hint=nearest(role, roles))
            )
    return [replace(unit, options={**unit.options, **options.get(unit.kind.role, {})}) for unit in units]
