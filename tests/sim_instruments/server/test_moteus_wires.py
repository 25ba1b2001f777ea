"""A moteus of a served bench, by its maker's package through both wires."""

import asyncio
import os
import select
from typing import Any

import moteus
import pytest
from moteus.fdcanusb_device import FdcanusbDevice
from moteus.pythoncan_device import PythonCanDevice

from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.motors import BENCH_MOTOR

UNITS = [SimulatedUnit(find("mjbots-moteus")), SimulatedUnit(find("delta-dyn200"))]
R = moteus.Register


def path_of(address: object) -> str:
    """The serial port in an address of an fdcanusb."""
    return str(address).removeprefix("fdcanusb://").partition("?")[0]


def device(way: str, bench: ServedBench) -> Any:
    """The package's device for a way."""
    address = bench.addresses()["inverter"][way]
    if way == "fdcanusb":
        return FdcanusbDevice(path_of(address))
    assert isinstance(address, dict)
    return PythonCanDevice(interface="slcan", channel=address["channel"], sleep_after_open=0)


async def used(c: Any) -> list[int]:
    """The modes on the way through a use of a controller."""
    modes = [(await c.query()).values[R.MODE]]
    await c.set_current(d_A=-1.0, q_A=2.0, query=True)
    while (await c.query()).values[R.MODE] != moteus.Mode.CURRENT:
        await asyncio.sleep(0.005)
    stream = moteus.Stream(c, use_flow_control=False)
    assert float(await stream.command(b"conf get servo.max_current_A", allow_any_response=True)) == 30.0
    found = await stream.read_data("servo_control")
    # The currents take some milliseconds of the wall's time to come.
    while (found.i_d_A, found.i_q_A) != pytest.approx((-1.0, 2.0), rel=1e-4):
        found = await stream.read_data("servo_control")
    assert found.q_V == pytest.approx(0.5 * 2.0, abs=0.3)
    modes.append((await c.query()).values[R.MODE])
    await c.set_stop(query=True)
    return [*modes, (await c.query()).values[R.MODE]]


def test_the_package_drives_it_by_slcan_and_by_an_fdcanusb() -> None:
    async def work(bench: ServedBench) -> None:
        for way in ("can", "fdcanusb"):
            with moteus.Transport(device(way, bench)) as transport:
                modes = await asyncio.wait_for(used(moteus.Controller(id=5, transport=transport)), 20.0)
            assert modes == [0, 9, 0]
            assert not bench.bench.world.truth()["inverter_enabled"]

    with ServedBench(BENCH_MOTOR, seed=1, units=UNITS) as bench:
        bench.bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        bench.bench.world.lock_rotor()
        asyncio.run(work(bench))


def test_both_at_once_hear_each_other() -> None:
    async def work(bench: ServedBench) -> None:
        transports = [moteus.Transport(device(way, bench)) for way in ("can", "fdcanusb")]
        try:
            one, other = (
                moteus.Controller(id=5, transport=transport, source_can_id=number)
                for number, transport in enumerate(transports)
            )
            await asyncio.wait_for(one.set_current(d_A=0.0, q_A=1.0, query=True), 5.0)
            while (await asyncio.wait_for(other.query(), 5.0)).values[R.MODE] != moteus.Mode.CURRENT:
                await asyncio.sleep(0.005)
            await asyncio.wait_for(other.set_stop(query=True), 5.0)
            assert (await asyncio.wait_for(one.query(), 5.0)).values[R.MODE] == moteus.Mode.STOPPED
        finally:
            for transport in transports:
                transport.close()

    with ServedBench(BENCH_MOTOR, seed=1, units=UNITS) as bench:
        bench.bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        asyncio.run(work(bench))


def test_the_watchdog_of_position_mode_counts_in_the_walls_time() -> None:
    async def work(bench: ServedBench) -> None:
        with moteus.Transport(device("fdcanusb", bench)) as transport:
            c = moteus.Controller(id=5, transport=transport)
            # At twenty times the wall's speed a tenth of a second is two on the bench.
            await c.set_position(position=float("nan"), velocity=0.0, watchdog_timeout=0.5, query=True)
            while (found := (await c.query()).values[R.MODE]) in (2, 3):
                await asyncio.sleep(0.002)
            assert found == moteus.Mode.POSITION
            began = bench.clock.now()
            while (await c.query()).values[R.MODE] == moteus.Mode.POSITION:
                await asyncio.sleep(0.01)
            assert (await c.query()).values[R.MODE] == moteus.Mode.TIMEOUT
            assert bench.clock.now() - began > 0.4 * 20.0

    with ServedBench(BENCH_MOTOR, seed=1, speedup=20.0, units=UNITS) as bench:
        bench.bench.world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        asyncio.run(asyncio.wait_for(work(bench), 20.0))


def test_lines_that_are_none_are_answered_and_do_no_harm() -> None:
    with ServedBench(BENCH_MOTOR, seed=1, units=UNITS) as bench:
        port = os.open(path_of(bench.addresses()["inverter"]["fdcanusb"]), os.O_RDWR | os.O_NOCTTY)
        try:
            os.write(port, b"\x00\xff nonsense\ncan send 8005 1100 BF\n")
            said = b""
            while b"rcv 500" not in said and select.select([port], [], [], 5.0)[0]:
                said += os.read(port, 4096)
            # The door's contact says where it stands, too.
            lines = [line for line in said.split(b"\r\n") if line and not line.startswith(b"rcv 1a0")]
            assert lines == [b"ERR unknown command", b"OK", b"rcv 500 210000 e B F"]
        finally:
            os.close(port)
