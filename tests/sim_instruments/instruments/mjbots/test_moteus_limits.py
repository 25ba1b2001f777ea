"""What bounds a moteus, what it trips on, how it is found, and what the line does to it."""

import math
import struct
from typing import Any

import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.catalogue import FAULT
from sim_instruments.faults.line_faults import Fault
from tests.sim_instruments.instruments.mjbots.conftest import Frames, moteus_bench, simulated


def regulating(frames: Frames, d: float, q: float) -> None:
    """Have it regulate currents (A), and wait until it has started up."""
    frames.ask("010009" + "0e1c" + struct.pack("<ff", q, d).hex())
    frames.bench.clock.sleep(0.05)


def reads(frames: Frames) -> tuple[int, int, float, float]:
    """Mode, fault, d and q current (A)."""
    answer = bytes.fromhex(frames.ask("1100" + "110f" + "1e04") or "")
    assert (answer[:2], answer[3:5], answer[6:8]) == (b"\x21\x00", b"\x21\x0f", b"\x2e\x04")
    q, d = struct.unpack("<ff", answer[8:16])
    return answer[2], answer[5], d, q


def turned_at(bench: VirtualBench, speed: float) -> None:
    """Turn the shaft at a speed (rad/s)."""
    bench.world.release_rotor()
    bench.world.couple_dynamometer()
    bench.world.dynamometer.command(speed)
    bench.world.dynamometer.enable(True)
    bench.clock.sleep(3.0)


def test_each_current_is_bounded_by_its_own(frames: Frames) -> None:
    frames.text("conf set servo.max_current_A 4")
    regulating(frames, -3.0, 6.0)
    assert reads(frames) == pytest.approx((9, 99, -3.0, 4.0), abs=1e-5)
    regulating(frames, -3.0, 3.0)
    assert reads(frames) == pytest.approx((9, 0, -3.0, 3.0), abs=1e-5)
    # In force for what it regulates already.
    frames.text("conf set servo.max_current_A 1")
    frames.bench.clock.sleep(0.05)
    assert reads(frames) == pytest.approx((9, 99, -1.0, 1.0), abs=1e-5)
    assert frames.bench.world.inverter.rotor_state().current == pytest.approx(-1 + 1j)


def test_the_places_that_a_position_may_have_bound_the_q_current_in_current_mode_too(frames: Frames) -> None:
    frames.text("conf set servopos.position_max -0.01")
    regulating(frames, -2.0, 4.0)
    # Half of the way over which it gives way.
    assert reads(frames) == pytest.approx((9, 103, -2.0, 2.0), abs=1e-4)
    regulating(frames, -2.0, -4.0)
    assert reads(frames) == pytest.approx((9, 0, -2.0, -4.0), abs=1e-4)


def test_a_largest_speed_takes_the_driving_current_away() -> None:
    with moteus_bench(sockets=False) as bench:
        frames = Frames(bench)
        turned_at(bench, 2.0 * math.pi * 11.0)
        frames.text("conf set servo.max_velocity 10")
        regulating(frames, 0.0, 20.0)
        assert reads(frames) == pytest.approx((9, 96, 0.0, 15.0), abs=0.05)
        regulating(frames, 0.0, -20.0)
        assert reads(frames) == pytest.approx((9, 0, 0.0, -20.0), abs=1e-4)


def test_a_largest_power_scales_both_currents(frames: Frames) -> None:
    frames.text("conf set servo.max_power_W 6")
    regulating(frames, -3.0, 4.0)
    # It comes to the current step by step, each by the voltage of the last.
    for _ in range(10):
        reads(frames)
        frames.bench.clock.sleep(0.05)
    mode, fault, d, q = reads(frames)
    assert (mode, fault) == (9, 97)
    # At rest all of it is lost, in winding and bridge.
    loss = 1.5 * (0.503 * (d * d + q * q) + 4.0 / math.pi * 1.0e-7 * 30_000 * 48.0 * math.hypot(d, q))
    assert loss == pytest.approx(6.0, rel=0.02)
    assert d / q == pytest.approx(-0.75, rel=1e-4)


def test_the_bus_bounds_the_currents_by_its_voltage() -> None:
    with moteus_bench(sockets=False) as bench:
        frames = Frames(bench)
        turned_at(bench, 400.0)
        regulating(frames, 0.0, 10.0)
        mode, fault, _, q = reads(frames)
        assert (mode, fault) == (9, 98)
        assert q < 5.0


def test_a_hot_board_and_a_hot_motor_bound_and_trip_it(frames: Frames) -> None:
    world = frames.bench.world
    frames.text("conf set servo.max_current_A 20")
    world.set_ambient_temperature(62.0)
    regulating(frames, 0.0, 18.0)
    mode, fault, _, q = reads(frames)
    assert (mode, fault) == (9, 100)
    assert q < 10.0
    world.set_ambient_temperature(90.0)
    assert reads(frames)[:2] == (1, 38)
    assert not world.truth()["inverter_enabled"]
    world.set_ambient_temperature(25.0)
    frames.ask("010000")
    frames.text("conf set servo.enable_motor_temperature 1")
    frames.text("conf set servo.motor_fault_temperature 100")
    world.set_winding_temperature(95.0)
    regulating(frames, 0.0, 18.0)
    assert reads(frames)[:2] == (9, 101)
    # It has cooled by a little.
    assert frames.ask("110a") == "210a5e"


@pytest.mark.parametrize(
    ("item", "fault"),
    [("servo.max_voltage 40", 34), ("motor.poles 0", 36), ("servo.fault_temperature 30", 38)],
)
def test_what_does_not_fit_is_a_fault_that_only_a_stop_ends(frames: Frames, item: str, fault: int) -> None:
    frames.text(f"conf set {item}")
    regulating(frames, 0.0, 1.0)
    assert reads(frames)[:2] == (1, fault)
    regulating(frames, 0.0, 1.0)
    assert reads(frames)[:2] == (1, fault)
    frames.text("d stop")
    assert reads(frames)[:2] == (0, 0)


def test_position_mode_begins_within_its_bounds_and_takes_no_stop_position(frames: Frames) -> None:
    frames.text("conf set servopos.position_min 0.5")
    frames.ask("01000a")
    frames.bench.clock.sleep(0.05)
    assert reads(frames)[:2] == (1, 39)
    frames.text("d stop")
    frames.text("conf set servopos.position_min nan")
    frames.ask("01000a" + "0d26" + struct.pack("<f", 1.0).hex())
    assert reads(frames)[:2] == (1, 45)


@pytest.mark.parametrize("mode", ["01", "02", "03", "04"])
def test_modes_of_its_own_are_not_commanded(frames: Frames, mode: str) -> None:
    assert frames.ask("0100" + mode) == ""
    frames.bench.clock.sleep(0.1)
    assert reads(frames)[:2] == (0, 0)
    assert not frames.bench.world.truth()["inverter_enabled"]


@pytest.mark.parametrize("mode", ["05", "06", "07", "08", "0e", "0f"])
def test_modes_that_are_left_out_put_nothing_out(frames: Frames, mode: str) -> None:
    frames.ask("0100" + mode + "0e1a" + struct.pack("<ff", 3.0, 3.0).hex())
    frames.bench.clock.sleep(0.1)
    assert reads(frames)[0] == int(mode, 16)
    assert not frames.bench.world.truth()["inverter_enabled"]


@pytest.mark.parametrize("seed", range(12))
def test_a_hostile_beginning_is_what_it_says(seed: int) -> None:
    with moteus_bench(sockets=False, hostile=seed) as bench:
        frames = Frames(bench)
        left = dict(word.split(" = ") for word in bench.left["inverter"] if " = " in word)
        modes = [word for word in bench.left["inverter"] if word.startswith("mode ")]
        frames.text("tel text")
        for name, value in left.items():
            assert frames.text(f"conf get {name}") == f"{value}\r\n"
        assert reads(frames)[0] == int(modes[0].removeprefix("mode "))
        assert bench.world.truth()["motor_torque"] == 0.0
        # The flash still holds what it was set up with.
        frames.text("conf load")
        assert frames.text("conf get servo.max_current_A") == "30\r\n"


def test_seeds_leave_different_states() -> None:
    def left(seed: int) -> tuple[str, ...]:
        with moteus_bench(sockets=False, hostile=seed) as bench:
            bench.address("inverter")
            return bench.left["inverter"]

    assert left(1) == left(1)
    assert len({left(seed) for seed in range(6)}) > 3


def test_silence_half_late_and_stale_replies(frames: Frames) -> None:
    faults = frames.bench.faults("inverter")
    faults.add(Fault.on("silence", r"^read 000H$"))
    assert frames.ask("1100") is None
    assert frames.ask("1100") == "210000"
    faults.add(Fault.on("half", "read"))
    assert frames.ask("1100" + "110f") == "210000"
    began = frames.bench.clock.now()
    faults.add(Fault.on("late", "read", delay=0.3))
    assert frames.ask("1100") == "210000"
    assert frames.bench.clock.now() - began > 0.3
    faults.add(Fault.on("stale", "read"))
    assert frames.ask("1100") is None
    assert frames.ask("110f") == "210000"
    assert frames.ask("1158") == "210f00"
    faults.clear()
    assert frames.ask("1158") == "215803"


def test_silence_takes_the_command_away_too(frames: Frames) -> None:
    frames.bench.faults("inverter").add(Fault.on("silence", "write 000H"))
    regulating(frames, 0.0, 1.0)
    assert reads(frames)[0] == 0


@pytest.mark.parametrize(
    ("kind", "value"), [("not_a_number", math.nan), ("overflow", pytest.approx(3.4e38, rel=1e-6)), ("frozen", 2.0)]
)
def test_readings_are_falsified_and_modes_are_not(frames: Frames, kind: str, value: Any) -> None:
    regulating(frames, 0.0, 2.0)
    frames.bench.injector.add(FAULT.validate_python({"fault": kind, "role": "inverter"}))
    if kind == "frozen":
        assert reads(frames)[3] == pytest.approx(2.0)
        regulating(frames, 0.0, 5.0)
    mode, fault, _, q = reads(frames)
    assert (mode, fault) == (9, 0)
    assert math.isnan(q) if kind == "not_a_number" else q == value
    frames.text("tel text")
    shown = frames.text("tel get servo_stats")
    said = {"not_a_number": "q_A nan", "overflow": "q_A 3399999", "frozen": "q_A 5.0000"}[kind]
    assert said in shown
    assert "servo_stats.mode 9" in shown


def test_off_the_bus_it_goes_on_and_hears_nothing(frames: Frames) -> None:
    regulating(frames, 0.0, 2.0)
    connection = frames.bench.connection("inverter")
    connection.pull()
    assert frames.ask("010000") is None
    assert frames.bench.world.truth()["inverter_enabled"]
    connection.plug()
    assert reads(frames)[0] == 9


def test_what_is_set_up_is_the_motors() -> None:
    with moteus_bench(sockets=False, options={"dc_voltage": 24.0, "conf": {"servo.pid_dq_hz": 300}}) as bench:
        frames = Frames(bench)
        assert frames.text("conf get motor.poles") == "8\r\n"
        assert frames.text("conf get servo.pid_dq_hz") == "300\r\n"
        assert float(frames.text("conf get motor.resistance_ohm")) == pytest.approx(0.5, rel=0.1)
        assert frames.ask("110d") == "210d30"
        assert simulated(bench).understands()[0] == "000H rw Mode"
