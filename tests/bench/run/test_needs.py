"""What a procedure says that it needs is what it reads, and a station that lacks it is refused before anything is touched."""

import io
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from bench.i18n.errors import InputError
from bench.journal.events.run import ProcedureFinished, ProcedureStarted
from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import installed
from bench.run.context import run_context
from bench.run.needs import check_needs, unmet
from bench.run.plan import make_plan
from bench.run.request import RunOptions, RunRequest
from bench.run.run import carry_out
from bench.safety.interrupts import Interrupts
from bench.station.station_file import Entry, load_station
from drivers.interfaces import Instrument, Role, Wanted
from procedures.core.demand import Measurand

#: What the methods read, by role where one name stands for several quantities.
READ = {
    "measure_voltage": {Measurand.VOLTAGE},
    "measure_current": {Measurand.CURRENT},
    "measure_frequency": {Measurand.FREQUENCY},
    "measure_amplitude": {Measurand.AMPLITUDE},
    "measure_speed": {Measurand.SPEED},
    "measure": {Measurand.SPEED, Measurand.TORQUE},
}
IMPEDANCE = {
    Wanted.RESISTANCE: {Measurand.RESISTANCE},
    Wanted.INDUCTANCE: {Measurand.INDUCTANCE},
    Wanted.BOTH: {Measurand.RESISTANCE, Measurand.INDUCTANCE},
}
#: Those that the virtual bench's hands can take through, with instruments that say that a person reads them.
BY_HAND = (
    "pole-pairs-static",
    "stator-resistance",
    "stator-resistance-dc",
    "dq-inductance-aligned",
    "back-emf-constant",
    "inertia",
    "torque-constant",
    "winding-balance",
)


class Heard:
    """What is read of each role while each procedure runs."""

    def __init__(self) -> None:
        self.procedure = ""
        self.read: dict[str, dict[Role, set[Measurand]]] = defaultdict(lambda: defaultdict(set))

    def hear(self, event: Any) -> None:
        body = getattr(event, "body", event)
        if isinstance(body, ProcedureStarted):
            self.procedure = body.procedure
        elif isinstance(body, ProcedureFinished):
            # What the shutdown reads is no procedure's.
            self.procedure = ""

    def entry(self, entry: Entry) -> Entry:
        """Return an entry whose instrument says that a person reads it, and is listened to."""

        def opened(address: str, options: Any, surroundings: Any, name: str) -> Instrument:
            return self._by_hand(entry.driver.open(address, options, surroundings, name=name), entry.role)

        return replace(entry, driver=replace(entry.driver, opener=opened))

    def _by_hand(self, instrument: Any, role: Role) -> Instrument:
        kind = type(instrument)

        def attribute(this: Any, name: str) -> Any:
            if name in ("read_by_hand", "gives_waveforms"):
                return name == "read_by_hand"
            found = super(kind_by_hand, this).__getattribute__(name)
            if name in READ:
                return lambda *given: self._noted(role, name, found, *given)
            return found

        kind_by_hand: Any = type(kind.__name__, (kind,), {"__getattribute__": attribute})
        instrument.__class__ = kind_by_hand
        made: Instrument = instrument
        return made

    def _noted(self, role: Role, name: str, method: Any, *given: Any) -> Any:
        what = IMPEDANCE[given[0]] if role is Role.LCR_METER else READ[name]
        self.read[self.procedure][role] |= what
        return method(*given)


def test_each_procedure_reads_by_hand_what_it_says_that_it_needs(tmp_path: Path) -> None:
    catalogue = installed().procedures
    motor = load_motor("lg-400w", catalogue)
    plan, interrupts, heard = make_plan(BY_HAND, (), catalogue), Interrupts(), Heard()
    request = RunRequest(procedures=BY_HAND, motor=motor, station="virtual", language="en", runs=tmp_path)
    with run_context(request, Console(file=io.StringIO()), interrupts, "test") as context:
        entries = {role: heard.entry(entry) for role, entry in context.station.entries.items()}
        context = replace(context, station=replace(context.station, entries=entries))
        options = RunOptions(listeners=(heard.hear,), durable=False)
        done = carry_out(request, plan, context, interrupts, options)
    assert done.view.status == "completed", done.view.cause
    for planned in plan:
        needed = planned.procedure.needed(planned.settings)
        declared = {role: {*demand.figures, *demand.screen} for role, demand in needed.items()}
        assert heard.read[planned.name] == declared, planned.name


STATION = """
[station]
name = "read by hand"

[instruments.lcr_meter]
driver = "manual"
resistance_accuracy = { gain = 0.01, source = "manual" }

[instruments.oscilloscope]
driver = "manual"
probes = { 1 = "V", 4 = "A" }

[instruments.dynamometer]
driver = "manual"
maximum_speed = 500.0
maximum_torque = 3.0

[instruments.inverter]
driver = "manual"
maximum_current = 10.0
maximum_frequency = 100.0
"""


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("stator-resistance", [], []),
        ("winding-balance", [], ["lcr_meter: inductance_accuracy is not stated"]),
        (
            "pole-pairs-back-emf",
            [],
            ["it needs [instruments.tachometer]", "oscilloscope: frequency_accuracy is not stated"],
        ),
        (
            "phase-order",
            [],
            [
                "dynamometer: needs more readings than a person can take",
                "oscilloscope: needs more readings than a person can take",
            ],
        ),
        (
            "hall-sensors",
            [],
            [
                "oscilloscope: a person reads no waveforms",
                "oscilloscope: 2 probes of kind V are needed, the file names 1 (oscilloscope.probes)",
            ],
        ),
        (
            "torque-constant",
            [],
            [
                "dynamometer: speed_accuracy is not stated",
                "dynamometer: torque_accuracy is not stated",
                "inverter: current_accuracy is not stated",
            ],
        ),
        ("torque-constant", ["measured=false"], []),
    ],
)
def test_what_a_station_lacks_is_named_before_anything_is_touched(
    tmp_path: Path, name: str, settings: list[str], said: list[str]
) -> None:
    file = tmp_path / "station.toml"
    file.write_text(STATION, encoding="utf-8")
    station = load_station(file)
    plan = make_plan([name], settings, installed().procedures)
    assert [str(one) for one in unmet(plan[0], station)] == said
    if said:
        with pytest.raises(InputError) as refused:
            check_needs(plan, station)
        assert str(refused.value) == f"{file}: {name}: {'; '.join(said)}"
    else:
        check_needs(plan, station)


def test_what_an_inverter_cannot_do_is_said_from_its_driver(tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    table = 'driver = "mjbots-moteus"\naddress = "can://socketcan/can0?node=1"\nmaximum_current = 5.0\n'
    station.write_text(f'[station]\nname = "x"\n[instruments.inverter]\n{table}', encoding="utf-8")
    for name, said in (("pole-pairs-inverter", True), ("no-load-current", False)):
        (planned,) = make_plan([name], [], installed().procedures)
        lacking = [str(one) for one in unmet(planned, load_station(station))]
        refused = "inverter: mjbots-moteus does not offer a frequency at a current" in lacking
        assert refused is said, lacking


def test_what_finds_the_same_is_named_where_an_inverter_cannot() -> None:
    motor = load_motor("ipmsm-map")
    for names, said in (
        (
            ["pole-pairs-inverter", "flux-map"],
            [
                "inverter: mjbots-moteus does not offer a frequency at a current",
                "pole-pairs-static, pole-pairs-back-emf give the same result here, e.g. motorbench run "
                "pole-pairs-static flux-map",
                "Use a separate run: motorbench run pole-pairs-inverter",
            ],
        ),
        (
            ["pole-pairs-static", "pole-pairs-inverter", "flux-map"],
            ["leave it out, because pole-pairs-static gives the same result in this run"],
        ),
    ):
        request = RunRequest(names, motor, "virtual", "en", Path("unused"))
        plan = make_plan(names, [], installed().procedures)
        with (
            run_context(request, Console(file=io.StringIO()), Interrupts(), "test") as context,
            pytest.raises(InputError) as refused,
        ):
            check_needs(plan, context.station)
        for sentence in said:
            assert sentence in str(refused.value)
    request = RunRequest(["pole-pairs-back-emf", "flux-map"], motor, "virtual", "en", Path("unused"))
    with run_context(request, Console(file=io.StringIO()), Interrupts(), "test") as context:
        check_needs(make_plan(request.procedures, [], installed().procedures), context.station)
