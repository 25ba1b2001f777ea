"""One busy run on a served bench under the study's eyes: what it told, when everything went off, and how it ended."""

import json
import os
import re
import shutil
import signal
import threading
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import IO, Any

from tomli_w import dumps as toml_text

from bench.i18n.errors import InputError
from bench.journal.guardian_record import read_guardian
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder
from bench.journal.verification import Integrity
from bench.journal.verify import verify
from bench.safety.ownership.owner import holders
from bench.safety.ownership.state_folder import state_folder
from bench.virtual.virtual_station import as_text
from tests.studies.energised.held import Served
from tests.studies.forked import Forked
from tests.studies.kills.peers import is_guardian
from tests.studies.kills.proxy import Proxy
from tests.studies.kills.stunts import STACKS, hold_busily
from tests.studies.kills.trial import PATIENCE, Queues, Trial

_LOOK = 0.004
#: How long (s) a start may take on a machine with other work.
_START = 60.0
#: What is still on this (s) after a trial stays on.
_LEFT_ON = 5.0
#: What stands in the journal of a run that does not go on.
_ENDING = ("instrument_error", "de_energising", "step_failed", "procedure_failed", "way_down_started")
_PORT = re.compile(r"(?<=[:,])(\d+)(?=::|$|\?)")
#: What each way to a role's instrument is called in the served bench's addresses.
TRANSPORTS = {"socket": "supply", "hislip": "supply", "tcp": "dynamometer", "can": "inverter"}
#: SDO requests to the inverter's node and its replies, as a gateway's lines have them (LAWICEL).
_SDO = {"request": b"t605", "reply": b"t585"}


#: What of the bench's truth says that something is energised.
ENERGISED = ("output_on", "inverter_enabled", "dynamometer_enabled")


class Bench:
    """A served bench for one trial after the other, with a proxy before supply and dynamometer where one is wanted."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.served = Served(folder)
        self._number = 0

    @property
    def world(self) -> Any:
        return self.served.world

    def place(self, name: str) -> Path:
        """Return a new folder for a trial."""
        self._number += 1
        folder = self.folder / f"{self._number:04d}-{re.sub(r'[^a-z0-9]+', '-', name.lower())}"
        folder.mkdir()
        return folder

    def station(
        self, folder: Path, transport: str = "", interlock_timeout: float | None = None
    ) -> tuple[Path, Proxy | None]:
        """Write a station file; the instrument at a `transport` is reached through the proxy that is returned too."""
        path = folder / "station.toml"
        station = json.loads(json.dumps(self.served.told["station"]))
        proxy = None
        for contact in station["interlocks"].values() if interlock_timeout else ():
            contact["timeout"] = interlock_timeout
        if transport:
            role = TRANSPORTS[transport]
            address = as_text(self.served.told["addresses"][role][transport])
            found = _PORT.search(address)
            assert found is not None, address
            proxy = Proxy(int(found.group()), **(_SDO if transport == "can" else {}))
            station["instruments"][role]["address"] = _PORT.sub(str(proxy.port), address)
        path.write_text(toml_text(station), encoding="utf-8")
        return path, proxy

    def truth(self) -> dict[str, Any]:
        return dict(self.served.world.truth())

    def energised(self, cut_off: Collection[str] = ()) -> bool:
        """Tell whether anything is on, but for what is `cut_off`."""
        truth = self.truth()
        return any(truth[key] for key in ENERGISED if key not in cut_off)

    def everything_off(self) -> None:
        """Bring the bench back for the next trial; one that the trial before has left energised is replaced."""
        self.served.mend()
        begun = monotonic()
        while self.truth()["energised"]:
            if monotonic() - begun > _LEFT_ON:
                self.replace()
                return
            threading.Event().wait(0.02)

    def replace(self) -> None:
        """Begin with a new bench: of what a fault has left behind, nothing shall count for the next trial."""
        self.served.end()
        self.served = Served(self.place("bench"))

    def close(self) -> None:
        self.served.end()


class NeverBegunError(Exception):
    """A run has ended before it had energised anything."""


class Victim:
    """A run that holds everything energised and is busy as `then` says."""

    def __init__(self, bench: Bench, folder: Path, station: Path, *then: str, resume: str = "") -> None:
        self.bench = bench
        self.folder = folder
        self.station = station
        self.lines: list[str] = []
        self.errors: list[str] = []
        #: The longest time (s) between two looks at the bench while it was waited for everything to be off.
        self.looked_late = 0.0
        self.process = Forked(hold_busily, str(station), folder / "runs", then, resume)
        self._readers = [
            threading.Thread(target=self._read, args=(stream, into), daemon=True)
            for stream, into in ((self.process.stdout, self.lines), (self.process.stderr, self.errors))
        ]
        for reader in self._readers:
            reader.start()

    def energise(self) -> None:
        """Wait until everything is on and have it go on from there. Raises NeverBegunError with what it said instead."""
        begun = monotonic()
        while "energised\n" not in self.lines:
            if monotonic() - begun > _START or not self._readers[0].is_alive():
                raise NeverBegunError(f"{self.lines[-1:]} {self.said[-300:]}")
            threading.Event().wait(0.005)
        self.process.stdin.write("go on\n")
        self.process.stdin.flush()

    @staticmethod
    def _read(stream: IO[str], into: list[str]) -> None:
        for line in stream:
            into.append(line)

    @property
    def said(self) -> str:
        """What it said on standard error."""
        return "".join(self.errors)

    @property
    def told_readings(self) -> int:
        """How many readings it told."""
        return sum(line == "r\n" for line in list(self.lines))

    @property
    def run(self) -> Path | None:
        """The run's folder."""
        return next((self.folder / "runs").glob("*/"), None) if (self.folder / "runs").exists() else None

    @property
    def guardian_pid(self) -> int:
        assert self.run is not None
        return [int(event.data["pid"]) for event in read_guardian(self.run) if event.kind == "started"][-1]

    @property
    def helped(self) -> list[str]:
        """Why the guardian has acted."""
        return [event.data["cause"] for event in read_guardian(self.run) if event.kind == "took"] if self.run else []

    @property
    def is_ending(self) -> bool:
        """Whether something has failed in the run, so that it ends by itself."""
        if self.run is None:
            return True
        events = read_journal(self.run / "journal.jsonl").events
        return any(event.kind in _ENDING for event in events)

    def off_within(self, seconds: float, cut_off: Collection[str] = ()) -> float | None:
        """Return when (s, monotonic) the bench itself says that all but what is `cut_off` is off, None where it is not in time."""
        begun = looked = monotonic()
        while self.bench.energised(cut_off):
            now = monotonic()
            self.looked_late, looked = max(self.looked_late, now - looked), now
            if now - begun > seconds:
                return None
            threading.Event().wait(_LOOK)
        now = monotonic()
        self.looked_late = max(self.looked_late, now - looked)
        return now

    def ended(self, trial: Trial) -> dict[str, Any]:
        """Wait for the run's end; return its status and cause, empty where it was killed. A hang is put down with its stacks."""
        begun = monotonic()
        while any(reader.is_alive() for reader in self._readers):
            if monotonic() - begun > PATIENCE:
                trial.faults.append(f"hangs: not ended within {PATIENCE:g} s")
                self.stacks(trial)
                self.process.send_signal(signal.SIGCONT)
                self.process.send_signal(signal.SIGKILL)
                break
            threading.Event().wait(0.01)
        for reader in self._readers:
            reader.join(5.0)
        self.process.join(5.0)
        with suppress(ValueError):
            return dict(json.loads(self.lines[-1] if self.lines else ""))
        return {}

    def queues(self) -> Queues:
        """Return the watch over the time that its processes and the bench wait for a processor."""
        return Queues((self.process.pid, self.guardian_pid, self.bench.served.process.pid))

    def stacks(self, trial: Trial) -> None:
        """Have a run that hangs say where."""
        trial.kept = trial.kept or "asked"
        self.process.send_signal(STACKS)
        threading.Event().wait(1.0)
        (self.folder / "stacks.txt").write_text(self.said, encoding="utf-8")

    def guardian_left(self, trial: Trial, *, killed: bool = False) -> None:
        """Wait until the guardian has left."""
        if self.run is None or killed:
            return
        begun = monotonic()
        while (events := read_guardian(self.run)) and events[-1].kind != "left":
            if not is_guardian(self.guardian_pid):
                # A run that ends does not wait for a frozen one.
                return
            if monotonic() - begun > PATIENCE:
                trial.faults.append(f"the guardian has not left after {PATIENCE:g} s: {events[-1]}")
                return
            threading.Event().wait(0.02)

    def examine(self, trial: Trial, ended: dict[str, Any]) -> None:
        """Hold the records against what was told and what happened."""
        if not ended and self.process.returncode != -signal.SIGKILL:
            trial.faults.append(f"ended without a word, status {self.process.returncode}")
        trial.then = str(ended.get("status", "killed"))
        trial.judge_cause(str(ended.get("cause", "")))
        trial.judge_stderr(self.said)
        if self.run is None:
            return
        events = read_journal(self.run / "journal.jsonl").events
        kept = sum(event.kind == "reading" for event in events)
        trial.missing = max(0, self.told_readings - kept)
        guardian = read_guardian(self.run)
        if any(event.kind == "interlock_opened" for event in [*events, *guardian]):
            trial.faults.append("an interlock has tripped that nobody has opened")
        finished = bool(events) and events[-1].kind == "run_finished"
        judge_verification(trial, self.run, finished=finished)
        if ended and not finished:
            trial.faults.append("it told its end, and the journal has none")

    def drop(self) -> None:
        """Leave nothing behind."""
        with suppress(ProcessLookupError):
            self.process.send_signal(signal.SIGCONT)
        self.process.close()


def judge_verification(trial: Trial, folder: Path, *, finished: bool, resumed: bool = False) -> None:
    """Hold what `results verify` says against what happened: an end is proven by a journal and a guardian that ended both."""
    closed = [event.kind for event in read_guardian(folder)[-1:]] in ([], ["left"])
    expected = {Integrity.UNTOUCHED} if finished and closed else {Integrity.UNFINISHED}
    if resumed:
        # The first session's guardian may have died, which the second one does not mend.
        expected = {Integrity.UNTOUCHED, Integrity.UNFINISHED}
    try:
        found = verify(RunFolder(folder))
    except InputError as error:
        trial.faults.append(f"results verify: {error}")
        return
    if found.verdict not in expected:
        words = "; ".join([*map(str, found.findings), *filter(None, [str(found.unproven)])])
        trial.faults.append(f"results verify says {found.verdict.value}: {words}")


def wait_until_let_go(folder: Path) -> bool:
    """Wait until nobody holds the instruments of a run's folder any more: its guardian first measures that they are off."""
    begun = monotonic()
    while any(holder.folder == str(folder.resolve()) for holder in holders(state_folder())):
        if monotonic() - begun > PATIENCE:
            return False
        threading.Event().wait(0.02)
    return True


def keep(trial: Trial, victim: Victim, kept: Path | None) -> None:
    """Keep the records of a trial that broke a promise."""
    if trial.good or kept is None:
        return
    (victim.folder / "trial.txt").write_text(f"{trial}\n\n{victim.said}\n{victim.lines[-3:]}\n", encoding="utf-8")
    kept.mkdir(parents=True, exist_ok=True)
    trial.kept = str(kept / f"{os.getpid()}-{victim.bench.folder.name}-{victim.folder.name}")
    shutil.copytree(victim.folder, trial.kept, dirs_exist_ok=True)
