import threading
from collections.abc import Iterator

import can
import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.line_faults import Fault
from sim_instruments.physics.motor.motor import VirtualMotor

SDO_REQUEST, SDO_REPLY = 0x605, 0x585
READ_STATUS = bytes.fromhex("40 41 60 00 00 00 00 00")


@pytest.fixture
def bench(bench_motor: VirtualMotor) -> Iterator[VirtualBench]:
    with VirtualBench(bench_motor, seed=1, sockets=False) as opened:
        yield opened


def test_no_thread_and_no_socket(bench: VirtualBench) -> None:
    threads = threading.active_count()
    addresses = bench.addresses()
    assert addresses["dynamometer"] == "in-process://dynamometer"
    assert addresses["tachometer"] == "in-process://tachometer"
    assert addresses["inverter"] == {"interface": "in-process", "channel": "bench", "node_id": 5}
    assert threading.active_count() == threads


def test_modbus_frames(bench: VirtualBench) -> None:
    stream = bench.stream("in-process://dynamometer")
    # MBAP header (transaction, protocol, length, unit), then: write 1 to 0016H, read it, read a register that is not there.
    stream.write(bytes.fromhex("0001 0000 0006 01 06 0016 0001"))
    assert stream.read(260, 0.0) == bytes.fromhex("0001 0000 0006 01 06 0016 0001")
    stream.write(bytes.fromhex("0002 0000 0006 01 03 0016 0001") + bytes.fromhex("0003 0000 0006 01"))
    assert stream.read(260, 0.0) == bytes.fromhex("0002 0000 0005 01 03 02 0001")
    stream.write(bytes.fromhex("03 3000 0001"))
    assert stream.read(4, 0.0) + stream.read(260, 0.0) == bytes.fromhex("0003 0000 0003 01 83 02")
    assert bench.clock.now() == pytest.approx(6e-3)


def test_modbus_faults_take_bench_time(bench: VirtualBench) -> None:
    stream, request = bench.stream("in-process://dynamometer"), bytes.fromhex("0001 0000 0006 02 03 0008 0002")
    faults = bench.faults("dynamometer")
    faults.add(Fault.at("silence", 1))
    faults.add(Fault.at("half", 2))
    faults.add(Fault.at("late", 3, delay=1.5))
    stream.write(request)
    assert stream.read(260, 1.0) == b""
    stream.write(request)
    assert len(stream.read(260, 1.0)) == 6
    stream.write(request)
    assert stream.read(260, 1.0)[-4:] == bytes.fromhex("0000 0004")
    assert bench.clock.now() == pytest.approx(1.0 + 1.5 + 3 * 2e-3)


@pytest.mark.parametrize("noise", ["0001 0001 0006 01 03 0016 0001", "0001 0000 0000 01 03", "0001 0000 FFFF 01 03"])
def test_bytes_that_are_no_frame_are_dropped(bench: VirtualBench, noise: str) -> None:
    stream = bench.stream("in-process://dynamometer")
    stream.write(bytes.fromhex(noise))
    assert stream.read(260, 0.1) == b""
    stream.write(bytes.fromhex("0002 0000 0006 01 03 0016 0001"))
    assert len(stream.read(260, 0.0)) == 11


def tachometer_bytes(motor: VirtualMotor, *, sockets: bool) -> bytes:
    """Return what the tachometer sends while the shaft is turned; over sockets it is asked at each moment."""
    frames: list[bytes] = []
    with VirtualBench(motor, seed=3, sockets=sockets) as bench:

        def at_once(time: float) -> None:
            frame = bench.instrument("tachometer").due(time)
            if frame is not None:
                frames.append(frame())

        if sockets:
            bench.clock.on_advance(at_once)
        else:
            bench.address("tachometer")
        for speed in (30.0, -70.0, 5.0, 0.0):
            bench.world.turn_shaft(speed)
            for pause in (1.0, 0.4, 0.7, 2.5):
                bench.clock.sleep(pause)
        return b"".join(frames) if sockets else bench.stream("in-process://tachometer").read(10_000, 0.0)


def test_tachometer_frames_are_those_of_their_moment_however_late_they_are_read(bench_motor: VirtualMotor) -> None:
    late = tachometer_bytes(bench_motor, sockets=False)
    assert late == tachometer_bytes(bench_motor, sockets=True)
    assert len(late) > 8 * 16


def test_a_tachometer_that_nobody_reads_loses_old_frames(bench: VirtualBench) -> None:
    bench.address("tachometer")
    line = bench.stream("in-process://tachometer")
    for _ in range(900):
        bench.clock.sleep(1.0)
    assert len(line.read(100_000, 0.0)) < 300 * 16
    assert line.read(1, 1.0) != b""
    line.reset_input_buffer()
    assert line.read(1, 0.1) == b""


def test_can_frames_are_answered_before_the_call_returns(bench: VirtualBench) -> None:
    bench.address("inverter")
    end, other, seen = bench.can_bus("bench"), bench.can_bus("bench"), []
    end.hand_over(seen.append)
    other.hand_over(seen.append)
    end.send(can.Message(arbitration_id=SDO_REQUEST, data=READ_STATUS, is_extended_id=False))
    # The other end sees request and reply, in the order of the wire; the sender does not see its own frame.
    assert sorted((frame.arbitration_id, bytes(frame.data[:6])) for frame in seen) == [
        (SDO_REPLY, bytes.fromhex("4B 41 60 00 50 02")),
        (SDO_REPLY, bytes.fromhex("4B 41 60 00 50 02")),
        (SDO_REQUEST, READ_STATUS[:6]),
    ]
    assert bench.clock.now() == pytest.approx(2e-3)
    bench.faults("inverter").add(Fault.at("silence", 1))
    seen.clear()
    other.shutdown()
    end.send(can.Message(arbitration_id=SDO_REQUEST, data=READ_STATUS, is_extended_id=False))
    assert seen == []
    end.shutdown()
    end.shutdown()
    with pytest.raises(can.CanOperationError):
        end.send(can.Message(arbitration_id=SDO_REQUEST, data=READ_STATUS))


def test_heartbeats_go_by_the_bench_clock(bench: VirtualBench) -> None:
    bench.address("inverter")
    end, seen = bench.can_bus("bench"), []
    end.hand_over(lambda frame: seen.append(frame.arbitration_id))
    threads = threading.active_count()
    # 1017H, producer heartbeat time: 100 ms.
    end.send(
        can.Message(arbitration_id=SDO_REQUEST, data=bytes.fromhex("2B 17 10 00 64 00 00 00"), is_extended_id=False)
    )
    for _ in range(30):
        bench.clock.sleep(0.05)
    assert seen.count(0x705) == pytest.approx(1.5 / 0.1, abs=1.1)
    bench.clock.sleep(3600.0)
    assert seen.count(0x705) < 20
    assert threading.active_count() == threads
    end.shutdown()


def test_what_is_not_there_is_named(bench: VirtualBench, virtual_bench: VirtualBench) -> None:
    with pytest.raises(LookupError, match="in-process://supply"):
        bench.stream("in-process://supply")
    with pytest.raises(LookupError, match="other"):
        bench.can_bus("other")
    with pytest.raises(LookupError):
        virtual_bench.stream("in-process://dynamometer")
    with pytest.raises(LookupError):
        virtual_bench.can_bus("bench")
