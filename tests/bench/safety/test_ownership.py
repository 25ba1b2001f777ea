"""One instrument, one owner: across processes, users and ways of writing an address; and the trips that all of them see."""

import json
import os
import pwd
import select
import signal
import socket
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from tomli_w import dumps as toml_text

from bench.cli.doctor import doctor
from bench.cli.station.reset import reset
from bench.i18n.errors import InputError
from bench.i18n.language import translator
from bench.journal.unrecorded import Unrecorded
from bench.motor.motor_file import load_motor
from bench.safety.interlocks import ready
from bench.safety.ownership.claims import Claim, claims_of
from bench.safety.ownership.owner import HeldError, HeldInstrumentError, holders, owning
from bench.safety.ownership.state_folder import FolderBusyError, StateFolder, state_folder, try_lock
from bench.safety.station_instruments import StationInstruments
from bench.safety.trip_latch import Latch
from bench.station.clock import SystemClock
from bench.station.station_file import load_station
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import describe
from procedures.core.bench import Role
from procedures.core.nameplate import Nameplate, WindingConnection
from sim_instruments.server.served_bench import ServedBench
from tests.command_line import Call
from tests.studies.energised.held import PATIENCE, Run, Served
from tests.studies.forked import Forked, command, motorbench

STATION = """
[station]
name = "Bench 1"
[instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::127.0.0.1::{port}::SOCKET"
serial_number = "MY59001234"
[instruments.tachometer]
driver = "manual"
"""
#: How fast a bench's time passes on which nothing but the supply is switched on.
QUICK = 50.0
PLATE = Nameplate("none", WindingConnection.WYE, rated_current=1e-3)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StateFolder:
    monkeypatch.setenv("MOTORBENCH_STATE", str(tmp_path / "state"))
    return state_folder()


@pytest.fixture
def listening() -> Iterator[tuple[int, list[object]]]:
    """A port on which an instrument could answer, and who has called there."""
    calls: list[object] = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def accept() -> None:
            try:
                while True:
                    calls.append(server.accept())
            except OSError:
                return

        threading.Thread(target=accept, daemon=True).start()
        yield server.getsockname()[1], calls
        server.shutdown(socket.SHUT_RDWR)
        for call, _ in calls:  # type: ignore[misc]
            call.close()


@pytest.fixture
def station(tmp_path: Path, listening: tuple[int, list[object]]) -> Path:
    path = tmp_path / "station.toml"
    path.write_text(STATION.format(port=listening[0]), encoding="utf-8")
    return path


def test_the_second_is_refused_with_the_holder_named_and_nothing_is_sent(
    folder: StateFolder, station: Path, listening: tuple[int, list[object]], call: Call, tmp_path: Path
) -> None:
    user = pwd.getpwuid(os.geteuid()).pw_name
    run = ("run", "stator-resistance-dc", "--station", str(station), "--motor", "lg-400w")
    with owning(folder, "motorbench run coast-down") as owner:
        owner.claim(claims_of(load_station(station)))
        owner.work_in(tmp_path / "runs" / "one")
        code, _, err = call(*run)
        assert code == 1
        assert (
            f"supply (TCPIP0::127.0.0.1::{listening[0]}::SOCKET): in use by {user} with motorbench run coast-down"
            in err
        )
        assert f"(process {os.getpid()}, since 20" in err
        assert f"folder {tmp_path / 'runs' / 'one'}). Nothing was sent to it." in err
        code, _, err = call(*run, "--language", "zh")
        assert code == 1
        assert f"正被占用，占用者：{user} 的 motorbench run coast-down（进程 {os.getpid()}" in err
        code, out, _ = call("station", "check", str(station), "--json")
        told = json.loads(out)
        assert (code, told["good"], told["instruments"]["supply"]["identity"]) == (1, False, None)
        assert f"in use by {user} with motorbench run coast-down" in told["instruments"]["supply"]["error"]
        assert told["instruments"]["tachometer"]["error"] is None
        code, out, _ = call("doctor", "--json")
        (one,) = json.loads(out)["in_use"]
        assert (one["pid"], one["what"], one["ended"]) == (os.getpid(), "motorbench run coast-down", False)
    assert listening[1] == []
    assert not (tmp_path / "runs").exists()
    assert holders(folder) == []
    assert [path.name for path in folder.path.iterdir()] == ["lock"]


@pytest.mark.parametrize("way", ["copy", "link", "another address", "another file with its serial number"])
def test_it_is_the_instrument_that_counts_and_not_the_file(
    folder: StateFolder, station: Path, tmp_path: Path, way: str
) -> None:
    other = tmp_path / "other.toml"
    content = station.read_text(encoding="utf-8").replace("Bench 1", "Bench 2")
    match way:
        case "copy":
            other.write_text(content, encoding="utf-8")
        case "link":
            other.symlink_to(station)
        case "another address":
            content = content.replace("TCPIP0::127.0.0.1", "TCPIP::LocalHost.").replace("MY59001234", "MY1")
            other.write_text(content, encoding="utf-8")
        case _:
            other.write_text(content.replace("127.0.0.1", "192.0.2.77"), encoding="utf-8")
    with owning(folder, "the first") as first, owning(folder, "the second") as second:
        first.claim(claims_of(load_station(station)))
        with pytest.raises(HeldError, match="with the first"):
            second.claim(claims_of(load_station(other)))
        assert [holder.what for holder in holders(folder)] == ["the first"]
    with owning(folder, "the third") as third:
        third.claim(claims_of(load_station(other)))


def test_all_or_none(folder: StateFolder) -> None:
    a, b, c = (Claim(name, frozenset({name})) for name in "abc")
    with owning(folder, "one") as one, owning(folder, "two") as two, owning(folder, "three") as three:
        one.claim([a, b])
        one.claim([b])
        with pytest.raises(HeldError, match=r"^b: in use"):
            two.claim([b, c])
        three.claim([c])


def test_an_instrument_is_known_by_its_serial_number_whatever_its_address(folder: StateFolder, tmp_path: Path) -> None:
    nowhere = Unrecorded()
    with ServedBench(load_motor("lg-400w").virtual_motor()) as served, ExitStack() as opened:
        ways = served.addresses()["supply"]
        assert len(ways) > 1
        made = []
        for number, address in enumerate(list(ways.values())[:2]):
            path = tmp_path / f"{number}.toml"
            path.write_text(toml_text(describe({"supply": address})), encoding="utf-8")
            read = load_station(path)
            owner = opened.enter_context(owning(folder, f"run {number}"))
            owner.claim(claims_of(read))
            made.append(
                StationInstruments(
                    read, PLATE, SystemClock(), nowhere, nowhere, StationVisa("@py"), lambda _: None, owner=owner
                )
            )
            opened.callback(made[-1].close)
        made[0].open(Role.SUPPLY)
        with pytest.raises(
            HeldInstrumentError, match=r"supply: in use by .* with run 0 .* at another address"
        ) as refused:
            made[1].open(Role.SUPPLY)
        assert "其序列号与正被占用的仪器相同" in refused.value.text.render(translator("zh"))
        assert not made[1].opened()


def test_the_guardian_of_a_killed_run_has_its_instruments_until_it_has_left(tmp_path: Path) -> None:
    """Two real runs on one served bench; the guardian is stopped for a while, so that it can be seen at it."""
    served = Served(tmp_path)
    first = Run(served, tmp_path / "runs", "wait")
    second = (
        "run",
        "pole-pairs-static",
        "--station",
        served.station,
        "--motor",
        "lg-400w",
        "--runs",
        tmp_path / "second",
    )
    try:
        guardian = first.guardian_pid
        gone = os.pidfd_open(guardian)
        before = served.world.truth()
        refused = command(*second)
        assert refused.returncode == 1
        assert f"process {first.process.pid}, since" in refused.stderr
        assert str(first.folder) in refused.stderr
        assert not (tmp_path / "second").exists()
        truth = served.world.truth()
        assert {key: truth[key] for key in ("energised", "output_on", "inverter_enabled")} == {
            key: before[key] for key in ("energised", "output_on", "inverter_enabled")
        }
        os.kill(guardian, signal.SIGSTOP)
        first.signal(signal.SIGKILL)
        while first.process.returncode is None:
            served.world.clock.sleep(0.1)
        refused = command(*second)
        assert refused.returncode == 1
        assert f"the guardian of {pwd.getpwuid(os.geteuid()).pw_name}'s motorbench run hold" in refused.stderr
        assert f"(process {first.process.pid}, which has ended;" in refused.stderr
        assert "which switches off what was left on" in refused.stderr
        os.kill(guardian, signal.SIGCONT)
        first.guardian_left()
        # What it wrote last stands there a moment before its process ends.
        assert select.select([gone], [], [], PATIENCE)[0]
        os.close(gone)
        assert served.world.truth()["energised"] is False
        done = command(*second, "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["parameters"]["pole_pairs"]["value"] == 4
    finally:
        with suppress(ProcessLookupError):
            os.kill(guardian, signal.SIGCONT)
        first.drop()
        served.end()


def test_two_runs_at_the_same_moment_one_is_refused(tmp_path: Path) -> None:
    served = Served(tmp_path, speedup=QUICK)
    run = ("run", "pole-pairs-static", "--station", str(served.station))
    run += ("--motor", "lg-400w", "--runs", str(tmp_path / "runs"))
    both = [Forked(motorbench, *run) for _ in "ab"]
    try:
        said = [one.communicate(timeout=120)[1] for one in both]
    finally:
        for one in both:
            one.close()
        served.end()
    assert {one.returncode for one in both} == {0, 1}, said
    refused = next(words for one, words in zip(both, said, strict=True) if one.returncode)
    assert f"(process {next(one.pid for one in both if not one.returncode)}, since" in refused
    assert len(list((tmp_path / "runs").iterdir())) == 1


@pytest.fixture
def as_nobody() -> Iterator[tuple[StateFolder, Callable[[Callable[[], object]], str]]]:
    """A folder that all users can reach, and what does something as another user and returns what it raised."""
    if os.geteuid() != 0:
        pytest.skip("only root can be another user")

    def do(work: Callable[[], object]) -> str:
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                os.setgroups([])
                os.setgid(65534)
                os.setuid(65534)
                work()
                said = ""
            except BaseException as error:  # noqa: BLE001
                said = f"{type(error).__name__}: {error}"
            os.write(writing, said.encode())
            os._exit(0)
        os.close(writing)
        with os.fdopen(reading, encoding="utf-8") as told:
            said = told.read()
        os.waitpid(child, 0)
        return said

    with tempfile.TemporaryDirectory() as made:
        Path(made).chmod(0o755)
        yield StateFolder(Path(made) / "state"), do


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_users_see_each_other(
    as_nobody: tuple[StateFolder, Callable[[Callable[[], object]], str]], station: Path
) -> None:
    folder, do = as_nobody
    read = load_station(station)

    def claim() -> None:
        with owning(StateFolder(folder.path), "theirs") as owner:
            owner.claim(claims_of(read))

    with owning(folder, "ours") as owner:
        owner.claim(claims_of(read))
        assert "HeldError" in (said := do(claim))
        assert "in use by root with ours" in said
    assert do(claim) == ""
    # What root has left behind keeps nobody from anything, although nobody may remove it.
    left = folder.path / "owner-left.jsonl"
    left.write_text('{"keys": ["a"]}\n', encoding="utf-8")
    assert do(claim) == ""
    assert left.exists()
    latch = Latch(folder, read)
    assert do(lambda: Latch(StateFolder(folder.path), read).trip("door", "open")) == ""
    trip = latch.standing()
    assert trip is not None
    assert latch.reset("root") is not None
    assert do(lambda: Latch(StateFolder(folder.path), read).take_reset()) == ""
    assert latch.take_reset() is None
    assert "PermissionError" not in do(lambda: Latch(StateFolder(folder.path), read).check_writable())


INTERLOCKED = """
[station]
name = "{name}"
[interlocks.{contact}]
address = "{address}"
number = 3
timeout = 0.2
"""


def interlocked(
    path: Path, name: str = "Bench 1", contact: str = "door", address: str = "tcp://127.0.0.1:1502"
) -> Path:
    path.write_text(INTERLOCKED.format(name=name, contact=contact, address=address), encoding="utf-8")
    return path


def test_a_trip_is_seen_through_whatever_file_names_the_contact(folder: StateFolder, tmp_path: Path) -> None:
    first = interlocked(tmp_path / "station.toml")
    Latch(folder, load_station(first)).trip("door", "open")
    link = tmp_path / "link.toml"
    link.symlink_to(first)
    for other in (
        interlocked(tmp_path / "copy.toml"),
        link,
        interlocked(tmp_path / "renamed.toml", "Bench 9", "gate", "tcp://localhost:1502"),
        interlocked(tmp_path / "moved.toml", address="tcp://127.0.0.1:1599"),
    ):
        with (
            pytest.raises(InputError, match=r"the interlock door was open at .*, and it has not been reset"),
            ready(load_station(other), folder),
        ):
            pass
    without = tmp_path / "without.toml"
    without.write_text('[station]\nname = "Bench 1"\n', encoding="utf-8")
    with pytest.raises(InputError, match="it has not been reset"), ready(load_station(without), folder):
        pass
    with pytest.raises(
        InputError, match=r"this station file has no \[interlocks\]\. Reset it with the station file that names"
    ):
        reset(without, by="Li Wei")
    elsewhere = interlocked(tmp_path / "elsewhere.toml", "Bench 7", address="tcp://127.0.0.1:1503")
    assert Latch(folder, load_station(elsewhere)).standing() is None


def test_an_interlock_found_open_at_the_start_needs_its_reset(tmp_path: Path, call: Call) -> None:
    served = Served(tmp_path, speedup=QUICK)
    run = ("run", "pole-pairs-static", "--station", str(served.station), "--motor", "lg-400w")
    copy = tmp_path / "copy.toml"
    copy.write_bytes(served.station.read_bytes())
    try:
        served.contact("door", closed=False)
        code, _, err = call(*run)
        assert code == 1
        assert "the interlock door is open. Close it, then: motorbench station reset" in err
        served.contact("door", closed=True)
        for words in (run, (*run[:3], str(copy), *run[4:])):
            code, _, err = call(*words)
            assert code == 1
            assert "the interlock door was open at 20" in err
        code, out, _ = call("station", "check", str(copy))
        assert code == 1
        assert "the interlock door was open at 20" in out
        # A line's file whose socket has the contact; a station file that is a copy would do as well.
        told = served.told["station"]
        line = tmp_path / "line.toml"
        own = {"instruments": told["instruments"], "interlocks": told["interlocks"]}
        line.write_text(toml_text({"station": told["station"], "sockets": {"a": own}}), encoding="utf-8")
        code, out, err = call("station", "reset", str(line), "--by", "Li Wei")
        assert (code, out[:18]) == (0, "reset by Li Wei: t"), err
        code, _, err = call(*run)
        assert code == 0, err
        began = json.loads(next((tmp_path / "runs").glob("*/journal.jsonl")).read_text("utf-8").splitlines()[0])
        assert began["data"]["interlocks"]["reset"]["reset_by"] == "Li Wei"
    finally:
        served.end()


def test_a_folder_that_cannot_be_used_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def said(path: Path) -> str:
        with pytest.raises(InputError) as refused:
            state_folder({"MOTORBENCH_STATE": str(path)})
        return str(refused.value)

    file, link, open_to_all = tmp_path / "file", tmp_path / "link", tmp_path / "open"
    file.touch()
    assert "cannot be used" in said(file)
    link.symlink_to(tmp_path)
    assert "it is no folder" in said(link)
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    assert "all users may delete all files there; chmod 1777" in said(open_to_all)
    assert state_folder({"MOTORBENCH_STATE": str(tmp_path / "new" / "one")}).path.stat().st_mode & 0o7777 == 0o1777
    monkeypatch.setenv("MOTORBENCH_STATE", str(file))
    assert doctor(json=True) == 1


def test_a_process_that_is_stopped_in_the_folder_is_named_as_the_fault(
    folder: StateFolder, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("bench.safety.ownership.state_folder._LONGEST", 0.05)
    other = os.open(folder.path / "lock", os.O_RDONLY | os.O_CREAT)
    try:
        assert try_lock(other)
        with pytest.raises(FolderBusyError, match=r"has locked this folder for 0\.05 s"), owning(folder, "one"):
            pass
        latch = Latch(folder, load_station(interlocked(tmp_path / "station.toml")))
        latch.trip("door", "open")
        assert latch.standing() is not None
    finally:
        os.close(other)
