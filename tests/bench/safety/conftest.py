"""A virtual bench whose instruments count what reaches them, behind the limits of a motor and a station."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

import pytest

from bench.motor.motor_file import load_motor
from bench.safety.limits.bounds import SetPoint
from bench.safety.station_instruments import StationInstruments
from bench.station.station_file import make_station
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import describe
from drivers.interfaces import Waveform
from procedures.core.bench import Role
from procedures.core.events import Event
from procedures.core.nameplate import Nameplate
from sim_instruments.bench import VirtualBench

Limits = Mapping[str, Mapping[str, float]]


class Nowhere:
    """Stands for journal and waveform store."""

    def record(self, event: Event) -> None:
        pass

    def store(self, name: str, waveform: Waveform) -> str:
        return ""


class Counted:
    """A bench, its instruments behind the limits, and how many messages the simulated ones have got."""

    def __init__(self, motor: str, nameplate: Mapping[str, Any], limits: Limits, stack: ExitStack) -> None:
        file = load_motor(motor)
        self.bench = stack.enter_context(VirtualBench(file.virtual_motor(), six_step=file.six_step, sockets=False))
        self.world = self.bench.world
        self.nameplate: Nameplate = replace(file.nameplate, **nameplate)
        told = describe(self.bench.addresses())
        for role, table in limits.items():
            told["instruments"][role]["limits"] = dict(table)
        self.heard: list[SetPoint] = []
        self.instruments = StationInstruments(
            make_station(told, "station.toml", b""),
            self.nameplate,
            self.bench.clock,
            Nowhere(),
            Nowhere(),
            StationVisa(self.bench.visa_library),
            lambda _: None,
            in_process=self.bench,
            observe=self.heard.append,
        )
        stack.callback(self.instruments.close)
        self.messages = 0
        for face in self.bench.instruments.values():
            for device in getattr(face, "units", {0: face}).values():
                for name in ("write", "read"):
                    if hasattr(device, name):
                        setattr(device, name, self._counting(getattr(device, name)))

    def __getitem__(self, role: str) -> Any:
        return self.instruments.get(Role(role))

    def _counting(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def counted(*arguments: Any, **named: Any) -> Any:
            self.messages += 1
            return call(*arguments, **named)

        return counted


@contextmanager
def counted_bench(motor: str = "lg-400w", limits: Limits | None = None, **nameplate: Any) -> Iterator[Counted]:
    with ExitStack() as stack:
        yield Counted(motor, nameplate, limits or {}, stack)


@pytest.fixture(scope="session")
def counted_bench_of() -> Callable[..., Any]:
    """Return the context manager of such a bench, for fixtures that live longer than a test."""
    return counted_bench


@pytest.fixture
def counted() -> Iterator[Callable[..., Counted]]:
    """Return what makes such a bench of a shipped motor, with limits by role and changes to the nameplate."""
    with ExitStack() as stack:
        yield lambda *arguments, **named: stack.enter_context(counted_bench(*arguments, **named))
