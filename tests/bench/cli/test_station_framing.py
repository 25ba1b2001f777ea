"""`motorbench station set-framing`: a C2000 as it is delivered, beside a DYN-200, on one serial line."""

import io
import json
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from bench.cli.main import main
from bench.motor.motor_file import load_motor
from drivers.delta import framing
from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.faults.line_faults import Fault
from sim_instruments.instruments.delta.c2000 import DeltaDrive
from tests.bench.serial_silence import not_waited_for
from tests.command_line import Call

WANTED = "?baudrate=19200&parity=N&stopbits=2"
NOT_RIGHT = "nothing was set"


class Bench:
    """A drive and a sensor on a line, and a station file for them."""

    def __init__(self, bench: VirtualBench, folder: Path) -> None:
        line = bench.instrument("dynamometer")
        self.bench, self.line = bench, line
        self.drive: DeltaDrive = next(unit for unit in line.units.values() if isinstance(unit, DeltaDrive))
        self.port = str(bench.address("dynamometer"))
        self.file = folder / "station.toml"
        self.write(self.port + WANTED)

    def write(self, address: str, **more: Any) -> None:
        table = {"driver": "delta-dyn200", "address": address, "maximum_speed": 100.0, **more}
        self.file.write_text(tomli_w.dumps({"station": {"name": "bench 1"}, "instruments": {"dynamometer": table}}))

    def stored(self) -> list[int]:
        return [self.drive.read(number, 1)[0] for number in (0x0900, 0x0901, 0x0904)]


Made = Callable[..., Any]


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Made:
    not_waited_for(monkeypatch)
    monkeypatch.setattr(framing, "_PAUSE", 0.01)

    @contextmanager
    def make(**options: Any) -> Iterator[Bench]:
        options = {"sensor_rate": 19200, **options}
        unit = SimulatedUnit(find("delta-dyn200"), options=options)
        with VirtualBench(load_motor("lg-400w").virtual_motor(), [unit], line="rtu", seed=1) as bench:
            bench.world.couple_dynamometer()
            yield Bench(bench, tmp_path)

    return make


@pytest.fixture
def delivered(made: Made) -> Iterator[Bench]:
    with made() as bench:
        bench.drive.deliver()
        yield bench


def test_a_new_drive_is_found_set_and_then_the_station_is_whole(call: Call, delivered: Bench) -> None:
    code, out, err = call("station", "check", str(delivered.file), "--json")
    error = json.loads(out)["instruments"]["dynamometer"]["error"]
    assert (code, err) == (1, "")
    assert "motorbench station set-framing" in error
    assert "no usable reply" in error
    code, out, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert (code, err) == (0, "")
    assert "answers at    9600 bit/s, 7N2 ASCII, unit 1" in out
    assert "would be set  19200 bit/s, 8N2 RTU, unit 1" in out
    assert "The instrument now answers at 19200 bit/s, 8N2 RTU, unit 1." in out
    assert "the DYN-200 answers at 19200 bit/s, 8N2 RTU, unit 2" in out
    assert "The station file says so already." in out
    assert delivered.stored() == [1, 192, 13]
    code, out, err = call("station", "check", str(delivered.file), "--json")
    told = json.loads(out)["instruments"]["dynamometer"]
    assert (code, err, told["error"]) == (0, "", None)
    queries = {one["query"][:5]: one for one in told["found_state"]}
    assert (queries["09-01"]["found"], queries["09-04"]["found"]) == ("192", "13")
    assert "motorbench station set-framing" in queries["09-04"]["effect"]
    code, out, _ = call("station", "set-framing", str(delivered.file), "dynamometer", "--json")
    assert (code, json.loads(out)["set"]) == (0, False)


def test_another_unit_is_printed_for_the_station_file_which_stays(call: Call, delivered: Bench) -> None:
    delivered.write(delivered.port + "?baudrate=9600&rtscts=false")
    before = delivered.file.read_bytes()
    code, out, _ = call(
        "station", "set-framing", str(delivered.file), "dynamometer", "--rate", "19200", "--format", "8n2", "--unit", "7",
        "--yes",
    )  # fmt: skip
    assert code == 0
    assert f'address = "{delivered.port}{WANTED}&rtscts=false"\ndrive_unit = 7' in out
    assert delivered.file.read_bytes() == before
    assert delivered.stored() == [7, 192, 13]
    assert set(delivered.line.units) == {2, 7}
    delivered.write(delivered.port + WANTED, drive_unit=7)
    assert call("station", "check", str(delivered.file), "--json")[0] == 0


@pytest.mark.parametrize(("answer", "set_"), [("y\n", True), ("n\n", False), ("", False)])
def test_it_asks_first(call: Call, delivered: Bench, monkeypatch: pytest.MonkeyPatch, answer: str, set_: bool) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(answer))
    code, out, _ = call("station", "set-framing", str(delivered.file), "dynamometer")
    assert "Set this now? [y/N]" in out
    assert ("Nothing was set." in out) is not set_
    assert code == (0 if set_ else 1)
    assert delivered.stored() == ([1, 192, 13] if set_ else [1, 96, 1])


def test_a_dry_run_and_json_without_yes_set_nothing(call: Call, delivered: Bench) -> None:
    code, out, _ = call("station", "set-framing", str(delivered.file), "dynamometer", "--dry-run")
    assert (code, "Nothing was set." in out) == (0, True)
    code, out, _ = call("station", "set-framing", str(delivered.file), "dynamometer", "--json")
    told = json.loads(out)
    assert (code, told["set"], told["found"]["at"]["form"], told["wanted"]["rate"]) == (1, False, "7N2", 19200)
    assert delivered.stored() == [1, 96, 1]


def test_what_acts_only_after_power_is_said(call: Call, made: Made) -> None:
    with made(drive_framing_acts="after power") as bench:
        bench.drive.deliver()
        code, out, _ = call("station", "set-framing", str(bench.file), "dynamometer", "--yes")
        assert code == 0
        assert "still answers at 9600 bit/s, 7N2 ASCII, unit 1: switch its power off and on" in out
        assert bench.stored() == [1, 192, 13]
        code, out, _ = call("station", "set-framing", str(bench.file), "dynamometer", "--dry-run")
        assert "is set to     19200 bit/s, 8N2 RTU, unit 1, which takes effect after its power has been off" in out
        bench.drive.power_cycle()
        assert call("station", "check", str(bench.file), "--json")[0] == 0


def test_a_drive_in_a_framing_that_nobody_expects_is_looked_for(call: Call, made: Made) -> None:
    with made() as bench:
        bench.drive.write(0x0901, [384])
        code, out, err = call("station", "set-framing", str(bench.file), "dynamometer", "--yes")
        assert code == 0
        assert "nor as delivered; looking in 102 framings, at most" in err
        assert "answers at    38400 bit/s, 8N2 RTU, unit 1" in out
        assert bench.stored() == [1, 192, 13]


def test_a_sensor_that_is_elsewhere_is_said_with_its_keys(call: Call, made: Made) -> None:
    with made(sensor_rate=9600) as bench:
        bench.drive.deliver()
        code, out, _ = call("station", "set-framing", str(bench.file), "dynamometer", "--yes")
        assert code == 0
        assert (
            "the DYN-200 does not answer at 19200 bit/s, 8N2 RTU, unit 2: at the sensor set parameters 08 to 19200"
            in out
        )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("--rate", "38400"),
            "drive and sensor (DYN-200) do not both support 38400 bit/s; allowed is 4800, 9600, 19200",
        ),
        (
            ("--format", "8E1"),
            "drive and sensor (DYN-200) do not both support 8E1 RTU; allowed is 8N2 RTU, 8N1 RTU",
        ),
        (("--format", "7N2"), "do not both support 7N2 RTU"),
        (("--unit", "2"), "unit 2 is the sensor's (transducer_unit)"),
        (("--unit", "255"), "a C2000 cannot be unit 255; allowed is 1 to 254"),
    ],
)
def test_what_drive_or_sensor_has_not_is_refused_before_anything_is_sent(
    call: Call, delivered: Bench, words: tuple[str, ...], said: str
) -> None:
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", *words, "--yes")
    assert code == 1
    assert said in err
    assert delivered.stored() == [1, 96, 1]


def test_a_number_that_another_unit_answers_to_is_refused(call: Call, delivered: Bench) -> None:
    # The station file has the sensor elsewhere than it is.
    delivered.write(delivered.port + WANTED, transducer_unit=3)
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--unit", "2", "--yes")
    assert code == 1
    assert "another unit answers at 19200 bit/s, 8N2 RTU, unit 2 already; nothing was set" in err
    assert delivered.stored() == [1, 96, 1]


def test_never_while_the_drive_runs(call: Call, delivered: Bench) -> None:
    delivered.drive.write(0x2001, [1000])
    delivered.drive.write(0x2000, [0x12])
    delivered.bench.clock.sleep(3.0)
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 1
    assert "the drive runs (2101H = " in err
    assert NOT_RIGHT in err
    assert delivered.stored() == [1, 96, 1]


def test_behind_a_gateway_it_is_the_gateway_that_is_set(call: Call, delivered: Bench) -> None:
    delivered.write("tcp://127.0.0.1:1?framer=rtu")
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 1
    assert "is no serial port of this computer" in err


def test_only_what_can_be_set_so(call: Call, delivered: Bench) -> None:
    code, _, err = call("station", "set-framing", str(delivered.file), "supply")
    assert code == 2
    assert "supply: no instrument of this name has a framing that can be set" in err


def test_a_scan_finds_a_drive_as_it_is_delivered(call: Call, delivered: Bench) -> None:
    line = delivered.port.removeprefix("rtu://")
    code, out, _ = call("station", "scan", "--modbus", line, "--units", "1-2", "--named-only", "--json")
    (found,) = json.loads(out)["found"]
    assert code == 0
    assert found["address"] == f"{delivered.port}?baudrate=9600&bytesize=7&parity=N&stopbits=2&framer=ascii"
    assert found["answer"].startswith("unit 1: Delta drive")


def test_a_reply_that_is_lost_with_the_change_is_no_error(call: Call, delivered: Bench) -> None:
    delivered.bench.faults("dynamometer").add(Fault.on("silence", "write 1 0901H"))
    code, out, _ = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 0
    assert "The instrument now answers at 19200 bit/s, 8N2 RTU, unit 1." in out


def test_a_drive_that_is_lost_is_said_with_the_way_back(
    call: Call, delivered: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = delivered.drive.write

    def written(address: int, values: list[int]) -> None:
        write(address, values)
        delivered.line.connection.pull()

    monkeypatch.setattr(delivered.drive, "write", written)
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 1
    assert "after 09-01 rate was set to 192 the drive does not answer; it may be at" in err
    assert "19200 bit/s, 7N2 ASCII, unit 1; 9600 bit/s, 7N2 ASCII, unit 1" in err
    assert "At its keypad set 09-00 = 1, 09-01 = 19.2 and 09-04 = 13" in err


def test_a_locked_parameter_is_said_with_where_the_drive_is(
    call: Call, delivered: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = delivered.drive.write
    monkeypatch.setattr(
        delivered.drive, "write", lambda address, values: None if address == 0x0904 else write(address, values)
    )
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 1
    assert "09-04 format is 1 after 13 was written. It answers at 19200 bit/s, 7N2 ASCII, unit 1" in err


@pytest.mark.parametrize(
    ("path", "reason"), [("/dev/nothing", "there is no such file or folder"), ("/dev/null", "it is no serial port")]
)
def test_a_port_that_cannot_be_opened_is_no_silent_drive(call: Call, delivered: Bench, path: str, reason: str) -> None:
    delivered.write(f"rtu://{path}{WANTED}")
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 1
    assert f"dynamometer: cannot be opened at rtu://{path}{WANTED} ({reason})" in err
    assert "looking in" not in err


@pytest.mark.parametrize("code_", [2, 4, 6])
def test_a_parameter_that_the_drive_refuses_is_said_with_where_it_is(call: Call, delivered: Bench, code_: int) -> None:
    delivered.bench.faults("dynamometer").add(Fault.on("exception", "write 1 0904H", code=code_))
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 1
    assert f"09-04 format was not set to 13: Modbus exception {code_} (" in err
    assert "It answers at 19200 bit/s, 7N2 ASCII, unit 1" in err
    assert delivered.stored() == [1, 192, 1]


def test_a_drive_that_is_busy_after_a_change_is_asked_again(
    call: Call, delivered: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = delivered.drive.write

    def written(address: int, values: list[int]) -> None:
        write(address, values)
        delivered.bench.faults("dynamometer").add(Fault.on("exception", f"read 1 {address:04X}H 1", code=6))

    monkeypatch.setattr(delivered.drive, "write", written)
    code, out, _ = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert (code, "The instrument now answers at" in out) == (0, True)
    assert delivered.stored() == [1, 192, 13]


def test_a_format_of_no_table_is_said(call: Call, delivered: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    read = delivered.drive.read
    monkeypatch.setattr(
        delivered.drive, "read", lambda address, count: [20] if address == 0x0904 else read(address, count)
    )
    code, _, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert code == 1
    assert "the drive at 9600 bit/s, 7N2 ASCII, unit 1 has 09-04 = 20, which is no format known (1 to 17)" in err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_in_the_middle_leaves_no_half_set_drive(
    call: Call, delivered: Bench, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    write = delivered.drive.write

    def written(address: int, values: list[int]) -> None:
        write(address, values)
        os.kill(os.getpid(), number)

    monkeypatch.setattr(delivered.drive, "write", written)
    before = signal.getsignal(number)
    code, out, err = call("station", "set-framing", str(delivered.file), "dynamometer", "--yes")
    assert (code, signal.getsignal(number)) == (0, before)
    assert "The command ends as soon as it is known where the instrument answers" in err
    assert "The instrument now answers at 19200 bit/s, 8N2 RTU, unit 1." in out
    assert delivered.stored() == [1, 192, 13]


class Errors(io.StringIO):
    """Standard error that is looked at after it was closed."""

    said = ""

    def close(self) -> None:
        self.said = self.getvalue()


class Pipe(io.StringIO):
    """A pipe whose reader goes once something was read so often."""

    def __init__(self, reads: int) -> None:
        super().__init__()
        self.reads = reads

    def flush(self) -> None:
        self.reads -= 1
        if self.reads < 0:
            raise BrokenPipeError


@pytest.mark.parametrize("words", [("--yes",), ("--yes", "--json")])
def test_where_the_drive_is_is_said_although_nobody_reads(
    delivered: Bench, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    told = Errors()
    monkeypatch.setattr("sys.stdout", Pipe(0 if "--json" in words else 1))
    monkeypatch.setattr("sys.stderr", told)
    with pytest.raises(SystemExit) as stop:
        main(("station", "set-framing", str(delivered.file), "dynamometer", *words))
    assert stop.value.code == 1
    assert "motorbench: It answers at 19200 bit/s, 8N2 RTU, unit 1." in told.said
    assert delivered.stored() == [1, 192, 13]


def test_nothing_is_set_where_nobody_reads_what_would_be(delivered: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    told = Errors()
    monkeypatch.setattr("sys.stdout", Pipe(0))
    monkeypatch.setattr("sys.stderr", told)
    with pytest.raises(SystemExit):
        main(("station", "set-framing", str(delivered.file), "dynamometer", "--yes"))
    assert told.said == "motorbench: Nothing was set.\n"
    assert delivered.stored() == [1, 96, 1]
