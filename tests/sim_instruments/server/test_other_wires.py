import os
import socket
import struct
import threading

import canopen
import numpy as np
import pytest
import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from sim_instruments.faults.line_faults import Fault
from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.motors import BENCH_MOTOR
from tests.sim_instruments.server import wires


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def frame(unit: int, pdu: bytes, transaction: int = 1) -> bytes:
    return struct.pack("!HHHB", transaction, 0, len(pdu) + 1, unit) + pdu


# Modbus


def test_pymodbus_by_tcp_and_by_rtu(bench: ServedBench) -> None:
    addresses = bench.addresses()["dynamometer"]
    tcp = ModbusTcpClient("127.0.0.1", port=wires.port_of(addresses["tcp"]), timeout=5)
    rtu = ModbusSerialClient(str(addresses["rtu"]).removeprefix("rtu://"), baudrate=9600, timeout=5)
    try:
        for client in (tcp, rtu):
            assert client.connect()
            for value in (1200, 0):
                assert not client.write_register(0x2001, value, device_id=1).isError()
                assert client.read_holding_registers(0x2001, device_id=1).registers == [value]
            assert not client.write_registers(0x010C, [500, 600], device_id=1).isError()
            assert client.read_holding_registers(0x010C, count=2, device_id=1).registers == [500, 600]
            assert client.read_holding_registers(0x09, device_id=2).registers == [4]
            assert client.read_holding_registers(0x5555, device_id=1).exception_code == 2
            assert client.write_register(0x000A, 9, device_id=1).exception_code == 3
        assert tcp.read_holding_registers(0x09, device_id=7).exception_code == 11
    finally:
        tcp.close()
        rtu.close()


@pytest.mark.parametrize(
    ("unit", "request_", "reply"),
    [
        (2, "03 0009 0001", "03 02 0004"),
        (2, "03 0008 0000", "83 03"),
        (2, "03 0008 007E", "83 03"),
        (2, "03 0008", "83 03"),
        (2, "03 0008 0001 00", "83 03"),
        (1, "06 2001 0064", "06 2001 0064"),
        (1, "10 010C 0002 04 0064 0065", "10 010C 0002"),
        (1, "10 010C 0002 04 0064", "90 03"),
        (1, "10 010C 0002 03 0064 0065", "90 03"),
        (1, "2B 0E 01 00", "AB 01"),
        (9, "03 0008 0001", "83 0B"),
    ],
)
def test_modbus_to_the_byte(bench: ServedBench, unit: int, request_: str, reply: str) -> None:
    with wires.stream(bench.addresses()["dynamometer"]["tcp"]) as connection:
        connection.sendall(frame(unit, bytes.fromhex(request_), 0xABCD))
        answer = frame(unit, bytes.fromhex(reply), 0xABCD)
        assert wires.exactly(connection, len(answer)) == answer


@pytest.mark.parametrize(
    "garbage", ["0001 0001 0006 01", "0001 0000 0001 01", "0001 0000 00FF 01", "47 45 54 20 2F 20 48"]
)
def test_what_is_no_modbus_is_hung_up_on(bench: ServedBench, garbage: str) -> None:
    with wires.stream(bench.addresses()["dynamometer"]["tcp"]) as connection:
        connection.sendall(bytes.fromhex(garbage))
        assert connection.recv(1) == b""


def test_requests_without_end_that_nobody_reads_the_answers_to_harm_nobody(bench: ServedBench) -> None:
    address = bench.addresses()["dynamometer"]["tcp"]
    with wires.stream(address) as deaf, wires.stream(address) as half, wires.stream(address) as good:
        half.sendall(b"\0\1\0")
        deaf.settimeout(0.3)
        with pytest.raises(TimeoutError):
            deaf.sendall(frame(2, b"\x03\0\x09\0\x01") * 1_000_000)
        # The deaf one still waits for room meanwhile.
        for _ in range(20):
            good.sendall(frame(2, b"\x03\0\x09\0\x01"))
            assert wires.exactly(good, 11)[-2:] == b"\0\x04"


def test_faults_of_the_modbus_line(bench: ServedBench) -> None:
    faults, request = bench.bench.faults("dynamometer"), frame(2, b"\x03\0\x09\0\x01")
    with wires.stream(bench.addresses()["dynamometer"]["tcp"]) as connection:

        def reply(patience: float = 10.0) -> bytes:
            connection.sendall(request)
            connection.settimeout(patience)
            return bytes(connection.recv(100))

        whole = reply()
        try:
            for kind in ("half", "silence", "garbage", "late"):
                faults.add(Fault.on(kind, "read 2 0009H 1", delay=2.0))
            assert reply() == whole[:5]
            with pytest.raises(TimeoutError):
                reply(0.2)
            garbage = reply()
            assert (garbage[:7], len(garbage)) == (whole[:7], len(whole))
            assert garbage != whole
            before = bench.clock.now()
            assert reply() == whole
            assert bench.clock.now() - before >= 2.0
        finally:
            faults.clear()


def test_babble_on_the_rtu_line_is_passed_over(bench: ServedBench) -> None:
    path = str(bench.addresses()["dynamometer"]["rtu"]).removeprefix("rtu://")
    with serial.Serial(path, 9600) as line:
        line.write(np.random.default_rng(1).bytes(100_000))
    client = ModbusSerialClient(path, baudrate=9600, timeout=0.5, retries=50)
    try:
        assert client.connect()
        assert client.read_holding_registers(0x09, device_id=2).registers == [4]
    finally:
        client.close()


# tachometer


def test_the_tachometer_streams_on_its_terminal(bench: ServedBench) -> None:
    world = bench.bench.world
    world.turn_shaft(10.0)
    try:
        with serial.Serial(str(bench.addresses()["tachometer"]["serial"]), 9600, timeout=5) as line:
            # The gate of the first frames began before the shaft was turned.
            line.reset_input_buffer()
            frames = [line.read_until(b"\r") for _ in range(5)]
    finally:
        world.hold_shaft()
        world.let_go()
    assert frames[-1][:5] == b"\x024122"
    assert int(frames[-1][7:15]) / 10.0 == pytest.approx(95.5, abs=0.5)


# CAN


def upload(channel: object, index: int, node: int = 5) -> bytes:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface="slcan", channel=channel, bitrate=500_000, sleep_after_open=0.0)
    try:
        remote = network.add_node(node, canopen.ObjectDictionary())
        remote.sdo.RESPONSE_TIMEOUT = 2.0
        return bytes(remote.sdo.upload(index, 0))
    finally:
        network.disconnect()


def test_canopen_through_the_gateway(bench: ServedBench) -> None:
    address = bench.addresses()["inverter"]["can"]
    assert isinstance(address, dict)
    assert (address["interface"], address["node_id"]) == ("slcan", 5)
    assert upload(address["channel"], 0x1008) == b"Virtual inverter"


def test_bytes_that_are_no_frames_are_refused(bench: ServedBench) -> None:
    channel = dict(bench.addresses()["inverter"]["can"])["channel"]  # type: ignore[arg-type]
    chance = np.random.default_rng(2)
    with socket.create_connection(("127.0.0.1", wires.port_of(channel)), timeout=5.0) as sender:
        for size in (1, 30, 1400):
            sender.sendall(chance.bytes(size))
        sender.sendall(b"\r")
        assert sender.recv(1)
        assert upload(channel, 0x1000) == (0x00020192).to_bytes(4, "little")


def test_two_benches_do_not_meet_and_leave_nothing_behind() -> None:
    threads, files = threading.active_count(), descriptors()
    with ServedBench(BENCH_MOTOR, speedup=50.0) as one, ServedBench(BENCH_MOTOR, speedup=50.0) as other:
        channels = [dict(bench.addresses()["inverter"]["can"])["channel"] for bench in (one, other)]  # type: ignore[arg-type]
        assert channels[0] != channels[1]
        other.bench.faults("inverter").add(Fault.on("replace", "6041H", reply=b"\x43\x41\x60\0\xff\xff\xff\xff"))
        assert upload(channels[0], 0x6041) != b"\xff\xff\xff\xff"
        assert wires.ask(one, "GET", "/faults")[1]["instruments"] == {}
    # What an earlier test hung up on may still be closing when this one begins to count.
    assert threading.active_count() <= threads
    assert descriptors() <= files
    one.close()


def test_a_port_that_cannot_be_had_is_an_error_and_all_is_closed() -> None:
    threads, files = threading.active_count(), descriptors()
    with pytest.raises(OSError, match=r"192\.0\.2\.1"):
        ServedBench(BENCH_MOTOR, host="192.0.2.1")
    # What an earlier test hung up on may still be closing when this one begins to count.
    assert threading.active_count() <= threads
    assert descriptors() <= files
