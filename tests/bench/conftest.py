"""A bench of fakes and a procedure of three steps, to try the application without any physics."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from pydantic import Field

from bench.i18n.language import translator
from bench.journal.journal import Journal
from bench.journal.run_view import RunView
from bench.operators.answers import Answers, AnswersOperator
from bench.run.plan import Planned, make_plan
from bench.run.sequencer import Runner
from drivers.interfaces import Accuracy, DynamometerReading, Identity, Instrument, Reading, Regulated, Waveform
from drivers.interfaces.text import text
from procedures.core.actions import ALIGN_D, ALIGN_Q, EnterReading
from procedures.core.bench import Bench, Operator, Role
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step


class Clock:
    """A clock that counts."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds


class FakeInstrument:
    """Anything on the fake bench; `trace` is shared by all and keeps the order of what was done."""

    def __init__(self, name: str, trace: list[str]) -> None:
        self.name = name
        self.trace = trace
        self.failing: dict[str, BaseException] = {}
        self.on = False
        self.maximum_current = 10.0
        self.maximum_voltage = 10.0
        self.maximum_speed = 600.0

    def _do(self, what: str) -> None:
        self.trace.append(f"{self.name}.{what}")
        if what in self.failing:
            raise self.failing[what]

    @property
    def identity(self) -> Identity:
        return Identity("Fake", self.name)

    def configure(self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE) -> None:
        self._do("configure")

    @contextmanager
    def energised(
        self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE
    ) -> Iterator[None]:
        self._do("on")
        self.on = True
        try:
            yield
        finally:
            self._do("off")
            self.on = False

    def driving_speed(self, speed: float) -> Any:
        return self.energised(speed, 0.0)

    def measure_current(self) -> Reading:
        self._do("measure_current")
        return Reading(1.25 if self.on else 0.0, "A", Accuracy(gain=0.001, source="fake"), 0.5)

    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        self._do("fetch")
        time = np.arange(4) * 1e-3
        return {channel: Waveform(channel, time, time * channel, "V", 1e-3) for channel in channels}

    def make_safe(self) -> None:
        self._do("make_safe")
        self.on = False

    def output_off(self) -> None:
        self._do("output_off")
        self.on = False

    def command_zero(self) -> None:
        self._do("command_zero")

    def measure_voltage(self) -> Reading:
        self._do("measure_voltage")
        return Reading(0.2, "V", Accuracy(), 0.5)

    def measure_frequency(self) -> Reading:
        self._do("measure_frequency")
        return Reading(0.0, "Hz", Accuracy(), 0.5)

    def measure_speed(self) -> Reading:
        self._do("measure_speed")
        return Reading(0.0, "rad/s", Accuracy(), 0.5)

    def measure(self) -> DynamometerReading:
        self._do("measure")
        return DynamometerReading(0.5, -0.1, 0.0, 0.0, Accuracy(), Accuracy())

    def close(self) -> None:
        self._do("close")


class FakeInstruments:
    """The runner's view of a station."""

    def __init__(self, instruments: Mapping[Role, Any]) -> None:
        self._instruments = instruments

    def available(self) -> Mapping[Role, Instrument]:
        return self._instruments

    def open(self, role: Role) -> None:
        pass

    def get(self, role: Role) -> Instrument:
        return self._instruments[role]

    def opened(self) -> Mapping[Role, Instrument]:
        return self._instruments

    def silent(self) -> Collection[Role]:
        return ()

    def close(self, roles: Collection[Role] | None = None) -> Sequence[str]:
        found = []
        for role, instrument in self._instruments.items():
            if roles is not None and role not in roles:
                continue
            try:
                instrument.close()
            except Exception as error:  # noqa: BLE001
                found.append(f"{role.value}: {error}")
        return found


class TinySettings(Settings):
    current: float = Field(default=1.0, gt=0.0, le=5.0, description="holding current, A")
    repeats: int = Field(default=2, ge=1)


class Tiny(Procedure[TinySettings]):
    """Three steps, one energised."""

    name: ClassVar[str] = "tiny"
    title: ClassVar[str] = "Tiny"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY})
    gives: ClassVar[tuple[str, ...]] = ("stator_resistance",)

    def measure(self) -> None:
        self.connect()
        self.hold()
        self.compute()

    @step("9.9/1", "Connect it", by_hand=True)
    def connect(self) -> None:
        self.bench.perform(ALIGN_D)

    @step("9.9/2", "Hold with {current} A")
    def hold(self) -> None:
        with self.bench.supply.energised(1.0, self.settings.current):
            self.bench.clock.sleep(1.0)
            self.current = self.bench.supply.measure_current().value

    @step("9.9/3", "Compute")
    def compute(self) -> None:
        temperature = self.bench.reading(EnterReading("winding_temperature", text("temperature"), "°C", -50.0, 200.0))
        quantity = self.bench.uncertainties.statistical("repeats", 0.016, 1e-4, 9.0)
        self.findings["temperature"] = temperature
        self.notice("E9", text("the share is {share:.0%}", share=0.25))
        self.report("stator_resistance", quantity, section="9.9", estimator="none", note_value=0.0161)


class Other(Tiny):
    """A second one, that gives the same parameter less well."""

    name: ClassVar[str] = "other"

    @step("9.9/1", "Connect it otherwise", by_hand=True)
    def connect(self) -> None:
        self.bench.perform(ALIGN_Q)

    @step("9.9/3", "Compute")
    def compute(self) -> None:
        assert self.known_value("stator_resistance") == 0.016
        quantity = self.bench.uncertainties.statistical("repeats", 0.02, 2e-4, 9.0)
        self.report("stator_resistance", quantity, section="9.9", estimator="none")


CATALOGUE: dict[str, type[Procedure[Any]]] = {"tiny": Tiny, "other": Other}


@pytest.fixture
def nameplate() -> Nameplate:
    return Nameplate(
        "Fake motor", WindingConnection.WYE, rated_current=4.0, maximum_current=8.0, maximum_speed_rpm=3000.0
    )


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def trace() -> list[str]:
    return []


@pytest.fixture
def fakes(trace: list[str]) -> dict[Role, FakeInstrument]:
    return {role: FakeInstrument(role.value, trace) for role in reversed(Role)}


@pytest.fixture
def make_runner(
    tmp_path: Path, clock: Clock, fakes: dict[Role, FakeInstrument], nameplate: Nameplate
) -> Iterator[Callable[..., Runner]]:
    journals = []

    def make(operator: Operator | None = None, journal: Journal | None = None, view: RunView | None = None) -> Runner:
        used = journal or Journal(tmp_path / "journal.jsonl", clock.now)
        journals.append(used)
        seen = view or RunView()
        used.listen(seen.apply)
        hands = operator or AnswersOperator(Answers({"winding_temperature": [25.0] * 8}, "answers.toml"))
        return Runner(
            instruments=FakeInstruments(fakes), operator=hands, clock=clock, journal=used, view=seen, nameplate=nameplate,
            translate=translator("en"),
        )  # fmt: skip

    yield make
    for journal in journals:
        journal.close()


@pytest.fixture
def about() -> dict[str, Any]:
    return {"run": "r", "motor": {"name": "Fake motor"}, "station": {}, "procedures": ["tiny", "other"], "settings": []}


@pytest.fixture
def plan() -> list[Planned]:
    return make_plan(["tiny", "other"], [], CATALOGUE)


@pytest.fixture
def kit() -> SimpleNamespace:
    """The classes of this file, for tests that make their own."""
    return SimpleNamespace(
        FakeInstruments=FakeInstruments,
        Tiny=Tiny,
        Other=Other,
        FakeInstrument=FakeInstrument,
        CATALOGUE=CATALOGUE,
        Bench=Bench,
    )
