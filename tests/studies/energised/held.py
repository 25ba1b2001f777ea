"""A virtual bench in a process of its own, and a run on it with everything energised, for those who end it in every manner."""

import json
import os
import signal
import time
from pathlib import Path
from typing import Any

from bench.cli.station.reset import reset
from bench.journal.codec import RecordedEvent
from bench.journal.guardian_record import read_guardian
from bench.journal.journal_file import read_journal
from bench.virtual.served_world import ServedWorld
from tests.studies.energised.held_run import hold
from tests.studies.forked import Forked, motorbench

#: Nobody dies in a test for longer than this (s), and a run that is started has everything on within the other.
PATIENCE, _STARTING = 30.0, 90.0
#: How often a run is begun: on a busy machine an instrument may answer later than its driver waits, and the run rightly ends.
_STARTS = 3


def quiet() -> dict[str, str]:
    """Return the environment of processes for tests, as it is now."""
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[3])}


class Served:
    """`motorbench sim serve`, and what is really so on it."""

    def __init__(
        self, folder: Path, *more: str, motor: str = "lg-400w", speedup: float = 20.0, wired: bool = True
    ) -> None:
        self.station = folder / "station.toml"
        pace = ("--speedup", str(speedup))
        words = ("--motor", motor, "--json", *pace, "--station-file", str(self.station), *more)
        self.process = Forked(motorbench, "sim", "serve", *words)
        self.told: dict[str, Any] = json.loads(self.process.stdout.readline())
        self.world = ServedWorld(self.told["control"])
        if wired:
            self.wire()

    def wire(self) -> None:
        """Put the motor on the inverter and the dynamometer."""
        self.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        self.world.hold_shaft()
        self.world.couple_dynamometer()
        self.world.let_go()

    def silence(self, role: str) -> None:
        """Have an instrument answer nothing any more."""
        self.world._ask("POST", "/faults", {"fault": "silence", "role": role, "pattern": "", "times": None})

    def truth_becomes(self, key: str, wanted: object) -> bool:
        """Wait until something is so."""
        begun = time.monotonic()
        while self.world.truth()[key] != wanted:
            assert time.monotonic() - begun < _STARTING
            self.world.clock.sleep(0.5)
        return True

    def contact(self, name: str, *, closed: bool) -> None:
        """Close or open a safety contact."""
        self.world._ask("POST", "/interlocks", {"name": name, "closed": closed})

    def reset(self, by: str) -> None:
        """Have a person reset what the interlocks have left."""
        assert reset(self.station, by=by) == 0

    def mend(self) -> None:
        """Take all faults away."""
        self.world._ask("DELETE", "/faults")

    def seconds_until_off(self) -> float:
        """Return how long it takes until nothing is energised any more."""
        begun = time.monotonic()
        while self.world.truth()["energised"]:
            assert time.monotonic() - begun < PATIENCE
            self.world.clock.sleep(0.1)
        return time.monotonic() - begun

    def end(self) -> None:
        self.world.__exit__()
        self.process.send_signal(signal.SIGTERM)
        self.process.communicate(timeout=PATIENCE)
        self.process.close()


class Run:
    """A held run under way, on a bench by its own station file or by another one of it."""

    def __init__(self, served: Served, folder: Path, *then: str, station: Path | None = None) -> None:
        self.served = served
        refused: list[str] = []
        while True:
            self.runs = folder / f"start-{len(refused)}"
            self.process = Forked(hold, str(station or served.station), self.runs, then)
            try:
                if self._begun(refused):
                    return
            except BaseException:
                self.drop()
                raise
            self.drop()
            assert len(refused) < _STARTS, "\n".join(refused)

    def _begun(self, refused: list[str]) -> bool:
        """See that everything is on, and have it go on from there; where it has ended instead, tell why in `refused`."""
        said = self.process.stdout.readline()
        if said != "energised\n":
            refused.append(said + self.process.communicate(timeout=PATIENCE)[1])
            return False
        truth = self.served.world.truth()
        assert (truth["output_on"], truth["inverter_enabled"], truth["dynamometer_enabled"]) == (True, True, True)
        self.process.stdin.write("go on\n")
        self.process.stdin.flush()
        return True

    def drop(self) -> None:
        """Leave nothing of it behind; its guardian leaves by itself."""
        self.process.close()

    @property
    def folder(self) -> Path:
        return next(self.runs.iterdir())

    @property
    def guardian(self) -> list[RecordedEvent]:
        return read_guardian(self.folder)

    @property
    def guardian_pid(self) -> int:
        return int(self.guardian[0].data["pid"])

    @property
    def journal(self) -> tuple[RecordedEvent, ...]:
        return read_journal(self.folder / "journal.jsonl").events

    def signal(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def ended(self) -> dict[str, Any]:
        """Return how the run ended, as it tells it itself."""
        output, errors = self.process.communicate(timeout=PATIENCE)
        assert self.process.returncode == 0, errors
        told: dict[str, Any] = json.loads(output.splitlines()[-1])
        return told

    def guardian_left(self) -> list[RecordedEvent]:
        """Return what the guardian wrote, once it has left."""
        begun = time.monotonic()
        while (events := self.guardian)[-1].kind != "left":
            assert time.monotonic() - begun < PATIENCE, events
            self.served.world.clock.sleep(0.2)
        return events
