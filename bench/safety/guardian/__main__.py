"""The guardian's process: its charge on standard input, its answers on standard output."""

import os
import signal
import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from time import monotonic
from typing import Any

from bench.files.toml_file import parse
from bench.i18n.errors import InputError
from bench.journal.events.safety import GuardianConnected, GuardianLeft, GuardianStarted, InterlockOpened
from bench.journal.guardian_record import GuardianRecord, complain, journal_head
from bench.safety.guardian.guarded_instruments import GuardedInstruments, is_shared
from bench.safety.guardian.lateness import RunQueue
from bench.safety.guardian.protocol import charge_of, decode, encode
from bench.safety.guardian.watch import Watch
from bench.safety.interlocks import Interlocks, cause, remember
from bench.safety.ownership.state_folder import state_folder
from bench.safety.trip_latch import Latch
from bench.station.library_logs import quieten_libraries
from bench.station.station_file import Station, make_station
from drivers.interfaces import InstrumentError
from drivers.interfaces.text import Text
from procedures.core.bench import Role


def main() -> None:
    """Read the charge, connect, watch, and carry out the shutdown where it is needed."""
    begun = monotonic()
    # Neither a pipe whose reader has died nor a supervisor that ends the whole group must end the one who is there for that:
    # it leaves by itself once the run has gone and everything is off.
    for number in (signal.SIGPIPE, signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)
    quieten_libraries()
    charge = charge_of(decode(_first_line()))
    record = GuardianRecord(Path(charge.folder))
    content = charge.content.encode()
    station = make_station(parse(content, charge.source), charge.source, content)
    instruments = GuardedInstruments(station, [Role(role) for role in charge.roles])
    parent = os.getppid()
    guarded = sorted(role.value for role in instruments.roles)
    record.record(GuardianStarted(pid=os.getpid(), run=parent, token=charge.token, roles=guarded))
    failed = instruments.open()
    watch = Watch(instruments, record, sys.stdin.fileno(), _say, charge.heartbeat, charge.stalled, RunQueue(parent))
    connected = GuardianConnected(opened=instruments.opened(), failed=failed, seconds=monotonic() - begun)
    record.record(connected)
    for role, error in failed.items():
        complain(f"is not connected to {role} and will try again when it must act: {error}")
    interlocks = _interlocks(station, watch, record)
    _say({"ready": asdict(connected), "record": asdict(record.head)})
    watch.run()
    interlocks.stop()
    # What a run that has died left unsaid is held by this record, and this record's end by itself.
    record.record(GuardianLeft(journal=journal_head(Path(charge.folder), durable=os.getppid() != parent)))
    closed = record.close()
    _say({"record": asdict(record.head), **({"left": True} if closed else {})})
    # Connections must not keep it from leaving, least of all those that do not answer any more: the system closes them.
    os._exit(0)


def _interlocks(station: Station, watch: Watch, record: GuardianRecord) -> Interlocks:
    """Watch the contacts that two processes can read; those on a line of their own are the run's to watch."""
    entries = [entry for entry in station.interlocks if is_shared(entry.address)]
    if not entries:
        return Interlocks(())
    try:
        latch = Latch(state_folder(), station)
        interlocks = Interlocks(entries)
    except (InstrumentError, InputError) as error:
        complain(str(error))
        watch.alarm(str(error))
        return Interlocks(())

    def opened(name: str, how: Text) -> None:
        watch.alarm(str(cause(name, how)))
        record.record(InterlockOpened(interlock=name, how=str(how), not_kept=remember(latch, name, how)))

    interlocks.watch(opened)
    return interlocks


def _first_line() -> bytes:
    line = b""
    while not line.endswith(b"\n"):
        part = os.read(sys.stdin.fileno(), 1)
        if not part:
            sys.exit("motorbench guardian: no charge on standard input; it is started by motorbench run")
        line += part
    return line


def _say(message: dict[str, Any]) -> None:
    with suppress(OSError):
        os.write(sys.stdout.fileno(), encode(message))


if __name__ == "__main__":
    main()
