"""A bench with a moteus in place of the usual inverter, its maker's package, and plain frames."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any

import can
import moteus
import pytest
from moteus.pythoncan_device import PythonCanDevice

from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.disturbances.current_loop import CurrentLoop
from sim_instruments.instruments.errors import Errors, InverterErrors
from sim_instruments.instruments.mjbots.moteus import SimulatedMoteus
from sim_instruments.transports.can.in_process import CHANNEL
from sim_instruments.world.machine_data import Leads
from tests.sim_instruments.motors import BENCH_MOTOR

NODE = 5
WIRED = {"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"}
#: A moteus without errors of its own; the bridge's are the stage's.
EXACT = Errors(inverter=InverterErrors(loop=CurrentLoop()))


@contextmanager
def moteus_bench(
    errors: Errors = EXACT,
    loop: CurrentLoop | None = None,
    *,
    sockets: bool = True,
    options: dict[str, Any] | None = None,
    motor: Any = BENCH_MOTOR,
    **bench: Any,
) -> Iterator[VirtualBench]:
    """The bench, wired up, with the rotor locked and no resistance in the leads."""
    units = [SimulatedUnit(find("mjbots-moteus"), options=options or {}), SimulatedUnit(find("delta-dyn200"))]
    setting = BenchSetting(leads=Leads(resistance=0.0), disturbances=Disturbances(inverter=loop or CurrentLoop()))
    with VirtualBench(motor, units, seed=1, errors=errors, sockets=sockets, setting=setting, **bench) as made:
        made.world.connect(WIRED)
        made.world.lock_rotor()
        yield made


def simulated(bench: VirtualBench) -> SimulatedMoteus:
    """The drive itself."""
    found = bench.instrument("inverter")
    assert isinstance(found, SimulatedMoteus)
    return found


Work = Callable[..., Awaitable[Any]]


def by_package(bench: VirtualBench, work: Work, *, clients: int = 1, **controller: Any) -> Any:
    """What `work` returns, which is given as many controllers of the maker's package, each with a bus of its own."""
    address = bench.address("inverter")
    assert isinstance(address, dict)

    async def run() -> Any:
        transports = [
            moteus.Transport(PythonCanDevice(interface=address["interface"], channel=address["channel"]))
            for _ in range(clients)
        ]
        try:
            made = [
                moteus.Controller(id=int(address["node_id"]), transport=one, source_can_id=number, **controller)
                for number, one in enumerate(transports)
            ]
            return await asyncio.wait_for(work(*made), 30.0)
        finally:
            await _close(transports, str(address["channel"]))

    return asyncio.run(run())


async def _close(transports: list[Any], channel: str) -> None:
    """Close them: the package's listening threads look for their end once a second, or when a frame comes."""
    closing = [asyncio.create_task(asyncio.to_thread(one.close)) for one in transports]
    with can.Bus(interface="virtual", channel=channel) as bus:
        while not all(task.done() for task in closing):
            bus.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
            await asyncio.sleep(0.01)
    await asyncio.gather(*closing)


class Frames:
    """Sends plain frames from an end of the bus in process, and keeps what comes."""

    def __init__(self, bench: VirtualBench, source: int = 0) -> None:
        bench.address("inverter")
        self.bench = bench
        self._source = source
        self.heard: list[can.Message] = []
        self._end = bench.can_bus(CHANNEL)
        self._end.hand_over(self.heard.append)

    def ask(self, data: str, *, respond: bool = True, node: int = NODE, prefix: int = 0, **frame: Any) -> str | None:
        """The data of the answer to a frame, both in hexadecimal; None without one."""
        self.heard.clear()
        identifier = prefix << 16 | (0x8000 if respond else 0) | self._source << 8 | node
        given = {"is_fd": True, "bitrate_switch": True, "is_extended_id": identifier > 0x7FF, **frame}
        self._end.send(can.Message(arbitration_id=identifier, data=bytes.fromhex(data), **given))
        return bytes(self.heard[0].data).hex() if self.heard else None

    def text(self, line: str, polls: int = 400) -> str:
        """What the diagnostic stream says to a line, up to `OK`, `ERR` or nothing more."""
        sent = f"{line}\n".encode()
        answer = self._stream(f"4001{len(sent):02x}{sent.hex()}")
        for _ in range(polls):
            more = self._stream("42013d")
            answer += more
            if not more:
                break
        return answer.decode()

    def _stream(self, data: str) -> bytes:
        answer = bytes.fromhex(self.ask(data) or "")
        assert answer[:2] == b"\x41\x01"
        return answer[3 : 3 + answer[2]]


@pytest.fixture
def frames() -> Iterator[Frames]:
    with moteus_bench(sockets=False) as bench:
        yield Frames(bench)
