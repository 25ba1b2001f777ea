"""How many mistakes in a driver the conformance kit finds: python -m tests.studies.mutations --count 200 --seed 1.

Each mutant is one change in one of our drivers' modules, made by its syntax tree and loaded in a process of its own.
"""

import argparse
import importlib
import importlib.util
import json
import math
import os
import resource
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

from bench.plugins.catalogues import installed
from bench.testing.conformance.driver import check_driver, subject_of
from bench.testing.conformance.report import Checks, ConformanceReport
from bench.testing.conformance.session import Trial, session_of
from tests.studies.mistakes.mutants import SUPPORTING, TARGETS, Mutant, mutants, path_of

_OWN = "tests.bench.testing.conformance.own_"

#: A check of one driver that takes longer (s, of the processor) does not end, which is found too; several times the longest one.
_PATIENCE = 120


@dataclass(frozen=True)
class Outcome:
    """What the kit says of a mutant: the first check that failed, empty where all passed; and how long it took (s)."""

    mutant: Mutant
    check: str
    seconds: float


class _Mutated(MetaPathFinder, Loader):
    """Imports one module from a changed source."""

    def __init__(self, mutant: Mutant) -> None:
        self._mutant = mutant

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Find the changed module only."""
        return importlib.util.spec_from_loader(fullname, self) if fullname == self._mutant.module else None

    def exec_module(self, module: ModuleType) -> None:
        """Execute the changed source."""
        exec(compile(self._mutant.source, f"<mutant of {self._mutant.module}>", "exec"), vars(module))  # noqa: S102  that is what a mutant is for


def _load(mutant: Mutant) -> None:
    """Have the drivers' modules be imported anew, the changed one among them; what declares them stays."""
    kept = ("drivers.interfaces", "drivers.transport", "drivers.catalogue", "drivers.manual", "drivers.recognition")
    for name in [name for name in sys.modules if name.startswith(("drivers.", _OWN))]:
        if not name.startswith(kept) or name == "drivers.transport.visa.opening":
            del sys.modules[name]
            package, _, last = name.rpartition(".")
            if package in sys.modules and hasattr(sys.modules[package], last):
                delattr(sys.modules[package], last)
    sys.meta_path.insert(0, _Mutated(mutant))
    installed.cache_clear()


def check_own(driver: str, *, first_only: bool = False, thorough: bool = True) -> ConformanceReport:
    """Check one of our drivers as thoroughly as it can be."""
    own: Any = importlib.import_module(f"{_OWN}drivers")
    return check_driver(
        own.driver_named(driver),
        options=(own.OPTIONS | own.OF_HOW_TO)[driver],
        found=own.FOUND.get(driver),
        catalogues=own.catalogues_of(driver),
        manual=own.manual_of(driver),
        variants=own.VARIANTS.get(driver, ()),
        thorough=thorough,
        first_only=first_only,
    )


def first_failure(mutant: Mutant, drivers: Sequence[str] = ()) -> str:
    """Return the first check that a mutant fails, in this process, of the drivers made of it or of these; empty where it passes all."""
    _load(mutant)
    for driver in drivers or {**TARGETS, **SUPPORTING}[mutant.module]:
        patience = math.ceil(time.process_time()) + _PATIENCE
        resource.setrlimit(resource.RLIMIT_CPU, (patience, resource.RLIM_INFINITY))
        report = check_own(driver, first_only=True)
        if report.failures:
            return str(report.failures[0])
    return ""


def examine(mutant: Mutant, drivers: Sequence[str] = ()) -> Outcome:
    """Return what the kit says of a mutant, in a process forked for it."""
    started = time.perf_counter()
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        said = "it cannot be loaded"
        try:
            sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: SIM115  it ends with the process
            said = first_failure(mutant, drivers)
        except BaseException as error:  # noqa: BLE001  a mutant may raise anything
            said = f"{type(error).__name__}: {error}"
        finally:
            os.write(writing, said.encode()[:4000])
            os._exit(0)
    os.close(writing)
    said = os.read(reading, 4096).decode(errors="replace")
    os.close(reading)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        said = "it does not end"
    return Outcome(mutant, said, time.perf_counter() - started)


def preload() -> None:
    """Load what every check needs, so that a forked process has it."""
    known, own = installed(), importlib.import_module(f"{_OWN}drivers")
    for name in own.OPTIONS:
        driver = own.driver_named(name)
        subject = subject_of(driver, None, own.OPTIONS[name], known, found=own.FOUND.get(name))
        with Trial(subject, session_of(subject.role), Checks(), 0).opened():
            """Opening is what imports."""


def unchanged(modules: Iterable[str], jobs: int) -> Iterator[Outcome]:
    """Give what the kit says of drivers whose modules are loaded anew and not changed, once for each driver."""
    served = {**TARGETS, **SUPPORTING}
    drivers = {driver: one for one in modules for driver in served[one]}
    nothing = [
        Mutant(one, "nothing", 0, "nothing", path_of(one).read_text(encoding="utf-8")) for one in drivers.values()
    ]
    with ThreadPoolExecutor(jobs) as pool:
        yield from pool.map(examine, nothing, ((driver,) for driver in drivers))


def _study(made: Sequence[Mutant], jobs: int) -> Iterator[Outcome]:
    """Give what the kit says of each mutant, and print it."""
    with ThreadPoolExecutor(jobs) as pool:
        for number, outcome in enumerate(pool.map(examine, made), 1):
            said = f"found by '{outcome.check[:90]}'" if outcome.check else "not found"
            print(f"{number}: {outcome.mutant.name}: {said} ({outcome.seconds:.1f} s)", flush=True)
            yield outcome


def main() -> None:
    """Make the mutants, examine each, and print what was found and what was not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200, help="so many of each seed")
    parser.add_argument("--seed", type=int, nargs="+", default=[1])
    parser.add_argument("--module", action="append", help="only these modules")
    parser.add_argument("--supporting", action="store_true", help="the modules that serve those of the drivers' use")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write every outcome there")
    chosen = parser.parse_args()
    preload()
    modules = chosen.module or tuple(SUPPORTING if chosen.supporting else TARGETS)
    made = {seed: mutants(chosen.count, seed, modules) for seed in chosen.seed}
    for outcome in unchanged({one.module for each in made.values() for one in each}, chosen.jobs):
        if outcome.check:
            parser.error(f"{outcome.mutant.module} as it is does not pass: {outcome.check}")
    outcomes = []
    for seed, mutants_of_seed in made.items():
        here = list(_study(mutants_of_seed, chosen.jobs))
        found = [one for one in here if one.check]
        print(f"seed {seed}: {len(found)} of {len(here)} found ({100.0 * len(found) / len(here):.1f} %)", flush=True)
        outcomes += here
    for kind, number in Counter(one.mutant.kind.split(" ")[0] for one in outcomes if not one.check).items():
        print(f"  not found: {number} × {kind}")
    if chosen.json:
        rows = [{"mutant": one.mutant.name, "check": one.check, "seconds": one.seconds} for one in outcomes]
        chosen.json.write_text(json.dumps(rows, indent=1, ensure_ascii=False), encoding="utf-8")


if __name__ == "__main__":
    main()
