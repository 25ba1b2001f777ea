"""The simulated moteus driven by its maker's own package, unmodified."""

import math
from typing import Any

import moteus
import numpy as np
import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.disturbances.current_loop import CurrentLoop
from tests.sim_instruments.instruments.mjbots.conftest import by_package, moteus_bench, simulated
from tests.sim_instruments.motors import BENCH_MOTOR

Controller = moteus.Controller
FIELDS = moteus.QueryResolution()
FIELDS.q_current = FIELDS.d_current = FIELDS.power = FIELDS.voltage = FIELDS.temperature = moteus.F32  # type: ignore[assignment]
R = moteus.Register


def turning(bench: VirtualBench, speed: float) -> None:
    """Have the dynamometer turn the shaft at a speed (rad/s)."""
    world = bench.world
    world.release_rotor()
    world.couple_dynamometer()
    world.dynamometer.command(speed)
    world.dynamometer.enable(True)
    bench.clock.sleep(abs(speed) / 500.0 + 1.0)


async def running(bench: VirtualBench, c: Any, d: float, q: float) -> None:
    """Regulate currents (A), and wait until the drive has started up."""
    # Asked for an answer: it is only then that the frame has been dealt with.
    await c.set_current(d_A=d, q_A=q, query=True)
    bench.clock.sleep(0.05)


async def control(c: Any) -> complex:
    """The loop's voltages (V), d + j·q."""
    stream = moteus.Stream(c, use_flow_control=False)
    found = await stream.read_data("servo_control")
    return complex(found.d_V, found.q_V)


def test_it_is_stopped_and_tells_what_there_is() -> None:
    async def work(c: Any) -> Any:
        return (await c.query()).values

    with moteus_bench() as bench:
        bench.world.set_ambient_temperature(20.0)
        values = by_package(bench, work, query_resolution=FIELDS)
    assert values[R.MODE] == moteus.Mode.STOPPED
    assert values[R.FAULT] == 0
    assert values[R.VOLTAGE] == 48.0
    assert values[R.TEMPERATURE] == 28.0
    assert [values[R.Q_CURRENT], values[R.D_CURRENT], values[R.POSITION], values[R.POWER]] == [0.0] * 4


@pytest.mark.parametrize("resolution", [moteus.INT8, moteus.INT16, moteus.INT32, moteus.F32])
def test_currents_come_in_every_resolution(resolution: int) -> None:
    fields = moteus.QueryResolution()
    fields.q_current = fields.d_current = resolution  # type: ignore[assignment]

    async def work(c: Any) -> Any:
        await running(bench, c, -3.0, 7.0)
        return (await c.query()).values

    with moteus_bench() as bench:
        values = by_package(bench, work, query_resolution=fields)
    step = {moteus.INT8: 1.0, moteus.INT16: 0.1, moteus.INT32: 0.001, moteus.F32: 1e-6}[resolution]
    assert values[R.MODE] == moteus.Mode.CURRENT
    assert values[R.Q_CURRENT] == pytest.approx(7.0, abs=1.01 * step)
    assert values[R.D_CURRENT] == pytest.approx(-3.0, abs=1.01 * step)


def test_currents_flow_until_it_is_stopped() -> None:
    async def work(c: Any) -> None:
        await running(bench, c, 0.0, 4.0)
        assert bench.world.truth()["inverter_enabled"]
        assert bench.world.truth()["motor_torque"] == pytest.approx(BENCH_MOTOR.torque_constant * 4.0, rel=1e-6)
        await c.set_stop(query=True)
        assert (await c.query()).values[R.MODE] == moteus.Mode.STOPPED
        assert not bench.world.truth()["inverter_enabled"]
        assert bench.world.truth()["motor_torque"] == 0.0

    with moteus_bench() as bench:
        by_package(bench, work)


def test_starting_takes_its_time() -> None:
    async def work(c: Any) -> None:
        await c.set_current(d_A=0.0, q_A=1.0, query=True)
        seen = [(await c.query()).values[R.MODE] for _ in range(60)]
        assert list(dict.fromkeys(seen)) == [2, 3, 9]
        assert 0.01 < 4.0e-4 * (seen.index(9) + 1) < 0.02

    with moteus_bench() as bench:
        by_package(bench, work)


@pytest.mark.parametrize(
    ("d", "q", "speed"), [(-3.0, 5.0, 100.0), (2.0, -4.0, 150.0), (-5.0, 0.0, -80.0), (0.0, 6.0, 20.0)]
)
def test_the_loops_voltages_are_those_of_the_motor(d: float, q: float, speed: float) -> None:
    """Nothing but the motor: u = R·i + jω·ψ."""

    async def work(c: Any) -> None:
        await running(bench, c, d, q)
        state = bench.world.inverter.rotor_state()
        flux = complex(0.02 + 1.0e-3 * d, 1.5e-3 * q)
        voltage = await control(c)
        assert voltage == pytest.approx(0.5 * complex(d, q) + 1j * state.electrical_speed * flux, rel=1e-3)

    with moteus_bench() as bench:
        # A bridge that loses nothing.
        stage = bench.world.inverter.stage
        for name in ("dead_time", "device_resistance", "device_drop"):
            object.__setattr__(stage, name, 0.0)
        turning(bench, speed)
        by_package(bench, work)


def test_with_every_imperfection_they_are_those_of_a_formula_beside_it() -> None:
    loop = CurrentLoop(
        dead_time=1.0e-6,
        device_drop=0.3,
        device_resistance=0.02,
        knee_current=0.5,
        current_gain=0.01,
        voltage_gain=-0.02,
        angle_error=0.03,
        voltage_delay=4.0e-5,
        current_noise=0.02,
        voltage_noise=0.05,
    )
    shown = -3.0 + 5.0j

    async def work(c: Any) -> None:
        await running(bench, c, shown.real, shown.imag)
        stream = moteus.Stream(c, use_flow_control=False)
        read = [await stream.read_data("servo_control") for _ in range(60)]
        voltages = np.array([complex(one.d_V, one.q_V) for one in read])
        speed = bench.world.inverter.rotor_state().electrical_speed
        # What flows, in the real rotor's coordinates; then leg by leg over a turn.
        current = shown * 1.01 * np.exp(0.03j)
        flux = 0.02 + 1.0e-3 * current.real + 1.5e-3j * current.imag
        turn = np.arange(7200) / 7200 * 2.0 * math.pi
        leg = abs(current) * np.cos(turn)
        stage = bench.world.inverter.stage
        step = 0.3 + stage.dead_time * 30_000.0 * 48.0
        lost = step * np.clip(leg / stage.knee_current, -1.0, 1.0) + (0.02 + 3.0e-3) * leg
        along = 2.0 * np.mean(lost * np.cos(turn)) * current / abs(current)
        needed = 0.5 * current + 1j * speed * flux + along
        expected = needed * 0.98 * np.exp(1j * (speed * 4.0e-5 - 0.03))
        assert stage.dead_time == pytest.approx(1.1e-6)
        assert complex(np.mean(voltages)) == pytest.approx(complex(expected), abs=5 * 0.05 / math.sqrt(60))
        assert float(np.std(voltages.real)) == pytest.approx(0.05, rel=0.35)
        assert float(np.std(voltages.imag)) == pytest.approx(0.05, rel=0.35)
        torque = 1.5 * 4 * (np.conj(flux) * current).imag
        assert bench.world.truth()["motor_torque"] == pytest.approx(float(torque), rel=1e-6)

    with moteus_bench(loop=loop) as bench:
        turning(bench, 120.0)
        by_package(bench, work)


def test_offsets_of_the_current_sensors_flow_unseen() -> None:
    async def work(c: Any) -> None:
        await running(bench, c, 0.0, 3.0)
        values = (await c.query()).values
        assert [values[R.D_CURRENT], values[R.Q_CURRENT]] == pytest.approx([0.0, 3.0], abs=1e-6)
        currents = bench.world.truth()["terminal_currents"]
        # At rest at angle 0 the d axis is A's: phase A shows 0.06 A, B −0.03 A too much of what flows.
        phases = {"A": 0.0, "B": 3.0 * math.sqrt(0.75), "C": -3.0 * math.sqrt(0.75)}
        common = (0.06 - 0.03) / 3.0
        unseen = {"A": -0.06 + common, "B": 0.03 + common, "C": common}
        assert currents == pytest.approx({name: phases[name] + unseen[name] for name in "ABC"}, abs=1e-6)

    with moteus_bench(loop=CurrentLoop(current_offset_a=0.06, current_offset_b=-0.03)) as bench:
        bench.world.inverter.stage.__dict__["current_ripple"] = 0.0
        by_package(bench, work, query_resolution=FIELDS)


def test_the_rotors_angle_is_the_encoders() -> None:
    async def work(c: Any) -> None:
        await running(bench, c, 0.0, 1.0)
        stream = moteus.Stream(c, use_flow_control=False)
        found = await stream.read_data("servo_stats")
        assert found.electrical_theta == pytest.approx((4 * 0.7 + 0.02) % (2.0 * math.pi), abs=1e-5)
        assert found.position == pytest.approx(0.7 / (2.0 * math.pi), abs=1e-6)
        assert found.mode == moteus.Mode.CURRENT
        assert found.d_A == pytest.approx(0.0, abs=1e-6)

    with moteus_bench(loop=CurrentLoop(angle_error=0.02)) as bench:
        bench.world.release_rotor()
        bench.world.move_shaft(0.7, 1.0)
        bench.clock.sleep(1.5)
        bench.world.lock_rotor()
        by_package(bench, work)


def test_the_diagnostic_stream_gives_and_takes_the_configuration() -> None:
    async def work(c: Any) -> None:
        stream = moteus.Stream(c)
        assert float(await stream.command(b"conf get servo.max_current_A", allow_any_response=True)) == 30.0
        await stream.command(b"conf set servo.max_current_A 12.5")
        assert float(await stream.command(b"conf get servo.max_current_A", allow_any_response=True)) == 12.5
        lines = (await stream.command(b"conf enumerate servo")).split(b"\n")
        assert b"servo.max_current_A 12.5" in lines
        assert all(line.startswith(b"servo.") for line in lines if line)
        await stream.command(b"conf load")
        assert float(await stream.command(b"conf get servo.max_current_A", allow_any_response=True)) == 30.0
        with pytest.raises(moteus.CommandError, match="unknown group"):
            await stream.command(b"conf set servos.max_current_A 1")
        with pytest.raises(moteus.CommandError, match="error setting"):
            await stream.command(b"conf set servo.max_current 1")
        with pytest.raises(moteus.CommandError, match="unknown command"):
            await stream.command(b"cnf get id.id")

    with moteus_bench() as bench:
        by_package(bench, work)


def test_telemetry_comes_as_text_and_in_binary() -> None:
    async def work(c: Any) -> None:
        await running(bench, c, -1.0, 2.0)
        stream = moteus.Stream(c, use_flow_control=False)
        found = await stream.read_data("servo_control")
        assert (found.i_d_A, found.i_q_A) == (-1.0, 2.0)
        await stream.command(b"tel text")
        text = (await stream.command(b"tel get servo_control")).decode().split("\n")
        shown = {name: float(value) for name, _, value in (line.partition(" ") for line in text if line)}
        assert shown["servo_control.i_q_A"] == 2.0
        assert shown["servo_control.q_V"] == pytest.approx(found.q_V, abs=1e-5)
        # Balanced about half of the bus, and the three voltages are the phases' own.
        a, b, c_ = (shown[f"servo_control.voltage.{phase}"] for phase in "abc")
        assert a + b + c_ == pytest.approx(0.0, abs=1e-5)
        duty = [shown[f"servo_control.pwm.{phase}"] for phase in "abc"]
        assert min(duty) + max(duty) == pytest.approx(1.0, abs=1e-5)
        assert (duty[0] - duty[1]) * 48.0 == pytest.approx(a - b, abs=1e-3)
        firmware = await stream.read_data("firmware")
        assert firmware.version == 0x010100
        assert len(firmware.serial_number) == 3
        with pytest.raises(moteus.CommandError, match="unknown name"):
            await stream.command(b"tel get servo")

    with moteus_bench() as bench:
        by_package(bench, work)


def test_periodic_telemetry_comes_with_the_polls_until_it_is_stopped() -> None:
    async def work(c: Any) -> None:
        stream = moteus.Stream(c, use_flow_control=False)
        await stream.command(b"tel text")
        await stream.command(b"tel rate system_info 20")
        bench.clock.sleep(0.05)
        assert (await stream.read_until_OK()).startswith(b"system_info.pool_size")
        await stream.command(b"tel stop")
        bench.clock.sleep(0.05)
        assert not (await c.diagnostic_read(max_length=61))[0].data

    with moteus_bench() as bench:
        by_package(bench, work)


def test_stopping_by_the_stream_works_whatever_the_mode() -> None:
    async def work(c: Any) -> None:
        await running(bench, c, 0.0, 2.0)
        await moteus.Stream(c, use_flow_control=False).command(b"d stop")
        assert not bench.world.truth()["inverter_enabled"]

    with moteus_bench() as bench:
        by_package(bench, work)


def test_two_clients_see_the_same_drive() -> None:
    async def work(one: Any, other: Any) -> None:
        await running(bench, one, 0.0, 2.0)
        values = (await other.query()).values
        assert values[R.MODE] == moteus.Mode.CURRENT
        assert values[R.Q_CURRENT] == pytest.approx(2.0, abs=1e-6)
        await other.set_stop(query=True)
        assert (await one.query()).values[R.MODE] == moteus.Mode.STOPPED
        streams = [moteus.Stream(c, use_flow_control=False) for c in (one, other)]
        for number, stream in enumerate(streams):
            await stream.command(b"conf set servo.max_velocity %d" % (number + 7))
            assert float(await stream.command(b"conf get servo.max_velocity", allow_any_response=True)) == number + 7

    with moteus_bench() as bench:
        by_package(bench, work, clients=2, query_resolution=FIELDS)


def test_it_is_discovered_and_reached_by_its_uuid() -> None:
    async def work(c: Any) -> None:
        (found,) = await c.transport.discover(timeout=0.5)
        assert found.can_id == 5
        by_uuid = moteus.Controller(id=moteus.DeviceAddress(uuid=found.uuid), transport=c.transport)
        assert (await by_uuid.query()).values[R.MODE] == 0
        stranger = moteus.DeviceAddress(uuid=bytes(16))
        nobody = moteus.Controller(id=stranger, transport=c.transport).make_stop(query=True)
        assert not simulated(bench).serve(nobody.data, respond=True)

    with moteus_bench() as bench:
        by_package(bench, work)


@pytest.mark.parametrize(("timeout", "mode"), [(0.02, 11), (math.nan, 10), (None, 11)])
def test_the_watchdog_acts_in_position_mode(timeout: float | None, mode: int) -> None:
    async def work(c: Any) -> None:
        await c.set_position(position=math.nan, velocity=0.0, watchdog_timeout=timeout, query=True)
        bench.clock.sleep(0.02)
        assert (await c.query()).values[R.MODE] == 10
        bench.clock.sleep(1.0)
        assert (await c.query()).values[R.MODE] == mode
        # From the time-out nothing leads but a stop.
        await c.set_current(d_A=0.0, q_A=1.0, query=True)
        assert (await c.query()).values[R.MODE] == (11 if mode == 11 else 9)
        await c.set_stop(query=True)
        assert (await c.query()).values[R.MODE] == 0

    with moteus_bench() as bench:
        by_package(bench, work)


def test_no_watchdog_acts_in_current_mode() -> None:
    async def work(c: Any) -> None:
        await running(bench, c, 0.0, 1.0)
        await moteus.Stream(c, use_flow_control=False).command(b"conf set servo.default_timeout_s 0.01")
        await c.set_current(d_A=0.0, q_A=1.0, query=True)
        bench.clock.sleep(60.0)
        assert (await c.query()).values[R.MODE] == moteus.Mode.CURRENT
        assert bench.world.truth()["motor_torque"] > 0.0

    with moteus_bench() as bench:
        by_package(bench, work)


def test_a_fixed_current_turns_the_field_in_open_loop() -> None:
    async def work(c: Any) -> None:
        command = c.make_position(position=math.nan, velocity=2.0, watchdog_timeout=math.nan)
        stream = moteus.Stream(c, use_flow_control=False)
        assert command.data
        await stream.command(b"d pos nan 2 1 c4")
        bench.clock.sleep(3.0)
        truth = bench.world.truth()
        assert truth["shaft_speed"] == pytest.approx(2.0 * 2.0 * math.pi, rel=1e-3)
        assert bench.world.inverter.current_amplitude() == pytest.approx(4.0)

    with moteus_bench() as bench:
        bench.world.release_rotor()
        by_package(bench, work)


def test_an_open_phase_drives_the_loop_to_its_limit() -> None:
    async def work(c: Any) -> None:
        await running(bench, c, 0.0, 2.0)
        values = (await c.query()).values
        assert values[R.MODE] == moteus.Mode.CURRENT
        assert values[R.FAULT] == 98
        assert values[R.Q_CURRENT] == pytest.approx(0.0, abs=1e-6)
        assert abs(await control(c)) == pytest.approx(bench.world.inverter.stage.maximum_phase_voltage, rel=1e-6)

    with moteus_bench() as bench:
        bench.world.set_open_phase("B")
        by_package(bench, work, query_resolution=FIELDS)


def test_position_mode_brings_the_shaft_to_a_velocity_and_holds_it() -> None:
    async def work(c: Any) -> None:
        begin = {"position": math.nan, "watchdog_timeout": math.nan, "query": True}
        await c.set_position(velocity=3.0, maximum_torque=0.2, **begin)
        bench.clock.sleep(0.014 + 0.005)
        assert bench.world.truth()["motor_torque"] == pytest.approx(0.2, rel=0.05)
        bench.clock.sleep(1.0)
        assert (await c.query()).values[R.VELOCITY] == pytest.approx(3.0)
        friction = 0.01 + 1.0e-5 * 6.0 * math.pi
        assert bench.world.truth()["motor_torque"] == pytest.approx(friction, rel=1e-3)
        # Against its direction, down to rest, and held there.
        await c.set_position(velocity=-1.0, maximum_torque=0.2, **begin)
        bench.clock.sleep(1.0)
        assert (await c.query()).values[R.VELOCITY] == pytest.approx(-1.0)
        await c.set_position(velocity=0.0, maximum_torque=0.2, **begin)
        bench.clock.sleep(1.0)
        assert (await c.query()).values[R.VELOCITY] == 0.0
        # With no gains there is the feedforward's torque alone.
        await c.set_position(velocity=0.0, kp_scale=0.0, kd_scale=0.0, feedforward_torque=0.05, **begin)
        bench.clock.sleep(0.01)
        assert bench.world.truth()["motor_torque"] == pytest.approx(0.05, rel=0.05)

    with moteus_bench() as bench:
        bench.world.release_rotor()
        by_package(bench, work)


@pytest.mark.parametrize(("speed", "way"), [(2.0 * math.pi, 1.0), (6.0 * math.pi, -1.0)])
def test_a_shaft_that_is_driven_at_another_velocity_is_pushed_with_all_that_is_allowed(
    speed: float, way: float
) -> None:
    async def work(c: Any) -> None:
        await c.set_position(position=math.nan, velocity=2.0, maximum_torque=0.3, watchdog_timeout=math.nan, query=True)
        bench.clock.sleep(0.1)
        assert bench.world.truth()["motor_torque"] == pytest.approx(way * 0.3, rel=0.05)
        assert bench.world.truth()["shaft_speed"] == pytest.approx(speed, rel=1e-3)

    with moteus_bench() as bench:
        turning(bench, speed)
        by_package(bench, work)


def test_after_the_watchdog_the_shaft_is_brought_to_rest() -> None:
    async def work(c: Any) -> None:
        await c.set_position(position=math.nan, velocity=3.0, watchdog_timeout=0.5, query=True)
        bench.clock.sleep(0.4)
        assert bench.world.truth()["shaft_speed"] == pytest.approx(6.0 * math.pi)
        bench.clock.sleep(1.0)
        assert (await c.query()).values[R.MODE] == moteus.Mode.TIMEOUT
        assert bench.world.truth()["shaft_speed"] == 0.0

    with moteus_bench() as bench:
        bench.world.release_rotor()
        by_package(bench, work)
