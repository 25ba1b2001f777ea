"""Our drivers on other people's simulated instruments, from checkouts of theirs: what works, and what is refused with which words.

`python -m tests.studies.foreign_simulators [--powers-tool DIR] [--kse4980 DIR --lewis COMMAND] [--zlac8015d DIR]`

- powers-tool (tom758258/powers-tool, MIT): a simulated E36312A, objects like PyVISA's, put behind a socket and an error queue here;
- kse4980 (ISISComputingGroup/EPICS-Kse4980): an emulated E4980AL, served by `lewis` (a package of PyPI) over TCP;
- zlac8015d (kaver06/ZLAC8015D-CANOpen-Motor-Controller-simulator): a simulated CiA 402 drive with two axes by canopen, on a
  virtual bus here. It lacks 0x1018, which CiA 301 asks for: the driver is tried on it as it is, and with 0x1018 added.

Their code runs as it is; none of it is kept here.
"""

import argparse
import contextlib
import importlib
import io
import shlex
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import canopen
import pyvisa

from drivers.catalogue import Surroundings
from drivers.cia402.inverter import Cia402Inverter
from drivers.cia402.options import Cia402Options
from drivers.interfaces import InstrumentError, Regulated
from drivers.keysight.e4980a import KeysightE4980A
from drivers.keysight.e36300 import KeysightE36300
from drivers.keysight.options import E4980AOptions, E36300Options

_CHANNEL = "foreign"
#: Until lewis serves (s).
_START = 3.0


class Wall:
    """The wall's clock."""

    def now(self) -> float:
        """Return the time (s)."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        threading.Event().wait(seconds)


def tried(what: str, call: Callable[[], Any]) -> Any:
    """Make a call, print what came of it, and return what it gave."""
    try:
        given = call()
    except InstrumentError as error:
        print(f"| {what} | refused | {str(error)[:200]} |")
        return None
    print(f"| {what} | works | {str(given)[:160]} |")
    return given


@contextlib.contextmanager
def behind_a_socket(resource: Any) -> Iterator[str]:
    """Serve an object that has write() and query() on a socket, lines both ways, and give its address; what it raises is queued."""
    queue: list[str] = []

    def answer(message: str) -> str | None:
        if message == "SYST:ERR?" and queue:
            return queue.pop(0)
        try:
            if "?" in message:
                return str(resource.query(message))
            resource.write(message)
        except Exception:  # noqa: BLE001  it raises for what it does not know; an instrument queues an error
            queue.append('-113,"Undefined header"')
        return None

    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            with contextlib.suppress(OSError):
                while True:
                    client, _ = server.accept()
                    with client, client.makefile("r", newline="\n") as lines:
                        for line in lines:
                            reply = answer(line.strip())
                            if reply is not None:
                                client.sendall(f"{reply}\n".encode())

        threading.Thread(target=serve, daemon=True).start()
        yield f"TCPIP0::127.0.0.1::{server.getsockname()[1]}::SOCKET"


def surroundings() -> Surroundings:
    """Return what a driver is handed."""
    manager = pyvisa.ResourceManager("@py")
    return Surroundings(Wall(), lambda: manager)


def powers_tool(folder: Path) -> None:
    """Open, set, switch and read the simulated E36312A of powers-tool."""
    sys.path.insert(0, str(folder / "src"))
    simulator = importlib.import_module("powers_tool_core.testing.simulator")
    resource = simulator.SimulatedResourceManager().open_resource("USB0::SIM::E36312A::INSTR")
    with behind_a_socket(resource) as address:
        supply = tried(
            "powers-tool E36312A: open",
            lambda: KeysightE36300.open(address, E36300Options(maximum_current=2.0), surroundings(), "supply"),
        )
        if supply is None:
            return
        tried("powers-tool E36312A: identity", lambda: supply.identity)
        tried("powers-tool E36312A: found state", lambda: [(one.query, one.found) for one in supply.found_state])
        tried("powers-tool E36312A: configure", lambda: supply.configure(2.0, 1.0, Regulated.VOLTAGE))
        tried("powers-tool E36312A: measure_voltage", lambda: supply.measure_voltage().value)
        tried("powers-tool E36312A: measure_current", lambda: supply.measure_current().value)
        tried("powers-tool E36312A: make_safe", supply.make_safe)
        tried("powers-tool E36312A: close", supply.close)


def kse4980(folder: Path, lewis: str) -> None:
    """Open the emulated E4980AL of EPICS-Kse4980."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    where = folder / "system_tests"
    options = f"stream: {{bind_address: 127.0.0.1, port: {port}}}"
    command = [*shlex.split(lewis), "-a", str(where), "-k", "lewis_emulators", "-p", options, "Kse4980"]
    served = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=where)
    try:
        threading.Event().wait(_START)
        address = f"TCPIP0::127.0.0.1::{port}::SOCKET"
        tried("Kse4980: open", lambda: KeysightE4980A.open(address, E4980AOptions(), surroundings(), "lcr_meter"))
    finally:
        served.terminate()
        served.wait()


def zlac8015d(folder: Path) -> None:
    """Open and read the simulated two-axis drive, as it is and with an identity."""
    sys.path.insert(0, str(folder / "src"))
    real = canopen.Network.connect

    def connect(network: Any, *_: Any, **__: Any) -> Any:
        return real(network, interface="virtual", channel=_CHANNEL)

    cast("Any", canopen.Network).connect = connect
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            made = importlib.import_module("backend.can_node").MotorControllerSimulator("virtual", 1)
            made.start()
    finally:
        cast("Any", canopen.Network).connect = real
    options = Cia402Options(
        maximum_current=5.0,
        maximum_frequency=50.0,
        current_scale=1.0,
        pole_pairs=15,
        velocity_unit="1 rpm",
        rated_current=6.0,
        heartbeat_time=0.0,
        process_data=False,
    )

    def opened() -> Cia402Inverter:
        with contextlib.redirect_stdout(io.StringIO()):
            return Cia402Inverter.open(f"can://virtual/{_CHANNEL}?node=1", options, Surroundings(Wall()), "inverter")

    tried("ZLAC8015D: open", opened)
    _add_identity(made.node.object_dictionary)
    inverter = tried("ZLAC8015D with 0x1018: open", opened)
    if inverter is not None:
        tried("ZLAC8015D with 0x1018: identity", lambda: inverter.identity)
        tried("ZLAC8015D with 0x1018: measure_frequency", lambda: inverter.measure_frequency())
        tried("ZLAC8015D with 0x1018: measure_current", lambda: inverter.measure_current())
        with contextlib.redirect_stdout(io.StringIO()):
            inverter.close()


def _add_identity(dictionary: Any) -> None:
    record = canopen.objectdictionary.ODRecord("Identity", 0x1018)
    for subindex, value in enumerate((4, 0x100, 1, 1, 1)):
        member = canopen.objectdictionary.ODVariable(f"identity {subindex}", 0x1018, subindex)
        member.data_type = canopen.objectdictionary.UNSIGNED32 if subindex else canopen.objectdictionary.UNSIGNED8
        member.value = value
        record.add_member(member)
    dictionary.add_object(record)


def main() -> None:
    """Try the drivers on what is given, and print a row for each call."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--powers-tool", type=Path, metavar="DIR")
    parser.add_argument("--kse4980", type=Path, metavar="DIR")
    parser.add_argument("--lewis", default="lewis", metavar="COMMAND")
    parser.add_argument("--zlac8015d", type=Path, metavar="DIR")
    given = parser.parse_args()
    print("| call | outcome | what came |\n| --- | --- | --- |")
    if given.powers_tool is not None:
        powers_tool(given.powers_tool)
    if given.kse4980 is not None:
        kse4980(given.kse4980, given.lewis)
    if given.zlac8015d is not None:
        zlac8015d(given.zlac8015d)


if __name__ == "__main__":
    main()
