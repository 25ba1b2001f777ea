"""pytest plugin: virtual motors, benches, runs and end-of-line plans as fixtures. Nothing is imported before one is asked for."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from motorbench import shadowed

if TYPE_CHECKING:
    from bench.motor.motor_file import MotorFile
    from bench.testing import MeasuredRun, PlanUnderTest
    from bench.testing.benches import BenchUnderTest
    from bench.testing.conformance.kit import Conformance
    from sim_instruments.server.served_bench import ServedBench


@pytest.fixture
def own_packages() -> None:
    """Fail in one sentence where a module of the user's own stands in front of one of motorbench's."""
    if sentence := shadowed():
        pytest.fail(sentence, pytrace=False)


@pytest.fixture
def virtual_motor(own_packages: None) -> "Callable[..., MotorFile]":
    """Make a virtual motor: `virtual_motor("lg-400w", flux_linkage=0.012)`, a shipped name or a file, true values changed."""
    from bench.testing import virtual_motor as make

    return make


@pytest.fixture
def virtual_bench(own_packages: None) -> "Iterator[Callable[..., BenchUnderTest]]":
    """Make a virtual bench in this process: `virtual_bench(motor, seed=1, faults=["supply: silence at 12"])`; it is closed after.

    What else it takes are BenchUnderTest's arguments: `fixture=True`, `station="bench.toml"`, `drive`, `options`, `disturbances`.
    """
    from bench.testing import virtual_motor as motor_of
    from bench.testing.benches import BenchUnderTest

    opened: list[BenchUnderTest] = []

    def make(
        motor: "MotorFile | str" = "lg-400w", *, seed: int = 0, faults: Sequence[str] = (), **how: Any
    ) -> BenchUnderTest:
        opened.append(BenchUnderTest(motor_of(motor) if isinstance(motor, str) else motor, seed, faults, **how))
        return opened[-1]

    yield make
    for each in reversed(opened):
        each.close()


@pytest.fixture
def served_bench(own_packages: None) -> "Iterator[Callable[..., ServedBench]]":
    """Serve a virtual bench on real sockets: `served_bench(motor, seed=1, speedup=20)`, `.addresses()` by role; it is closed after.

    What else it takes are ServedBench's arguments, `hostile=3` or `fixture=True` among them.
    """
    from bench.testing import virtual_motor as motor_of
    from sim_instruments.server.served_bench import ServedBench

    with ExitStack() as opened:

        def make(motor: "MotorFile | str" = "lg-400w", **how: Any) -> ServedBench:
            file = motor_of(motor) if isinstance(motor, str) else motor
            how = {"six_step": file.six_step, "speedup": 20.0, **how}
            return opened.enter_context(ServedBench(file.virtual_motor(), **how))

        yield make


@pytest.fixture
def run_procedure(own_packages: None, tmp_path: Path) -> "Callable[..., MeasuredRun]":
    """Measure a virtual motor: `run_procedure("back-emf-constant", motor=…, seed=1, faults=[…], settings={"repeats": 3})`.

    `fixture=True` has relays and an actuator work in place of hands, `station="bench.toml"` that file's drivers with their
    simulated instruments, `disturbances="dirt.toml"` a bench that something disturbs, `drawn_errors=True` instruments that err.
    """
    from bench.testing import RequestedBench, run_procedures
    from bench.testing import virtual_motor as motor_of

    def run(
        *names: str,
        motor: "MotorFile | str" = "lg-400w",
        seed: int = 0,
        settings: Mapping[str, Any] | None = None,
        faults: Sequence[str] = (),
        fixture: bool = False,
        station: Path | str = "virtual",
        disturbances: Path | str | None = None,
        drawn_errors: bool = False,
    ) -> "MeasuredRun":
        made = motor_of(motor) if isinstance(motor, str) else motor
        dirt = None if disturbances is None else Path(disturbances)
        bench = RequestedBench(str(station), "fixture" if fixture else "virtual", dirt, drawn_errors)
        return run_procedures(
            names, made, tmp_path / "runs", seed=seed, settings=settings or {}, faults=faults, bench=bench
        )

    return run


@pytest.fixture
def eol_plan(own_packages: None, tmp_path: Path) -> "Callable[..., PlanUnderTest]":
    """Read an end-of-line plan: `eol_plan("plan.toml").measure(flux_linkage=0.012).verdict`, on the bench that `eol run` has.

    `station="line.toml"` takes a station file's drivers with their simulated instruments, `operator="virtual"` virtual hands.
    """
    from bench.testing import PlanUnderTest

    return lambda path, **how: PlanUnderTest(Path(path), tmp_path / "runs", **how)


@pytest.fixture
def assert_holds_truth(own_packages: None) -> Callable[..., None]:
    """Assert that what was measured holds what is true: `assert_holds_truth(run_procedure("inertia"))`."""
    from bench.testing import assert_holds_truth as holds

    return holds


@pytest.fixture
def conformance(own_packages: None, tmp_path: Path) -> "Conformance":
    """Check a plug-in of one's own: `conformance.driver("my-supply")`, `.simulated_instrument`, `.procedure`, `.export`."""
    from bench.testing.conformance.kit import Conformance

    return Conformance(tmp_path / "runs")
