"""The virtual bench behind real endpoints: sockets and pseudo-terminals, for other processes."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from typing import Any, get_args

import numpy as np

from sim_instruments.bench import Address, VirtualBench
from sim_instruments.catalogue import Transport
from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.instruments.beckhoff.bk9000 import Bk9000
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.server.control.http import PATIENCE, JsonService
from sim_instruments.server.control.routes import control_routes
from sim_instruments.server.endpoints import LOOPBACK, PATIENT, Endpoints, RefusedClient
from sim_instruments.server.port_plan import PortPlan
from sim_instruments.server.safety_contacts import FRAME, ContactFrames, InputModule, SafetyContacts
from sim_instruments.transports.client import Patience
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.modbus.unit import ModbusLine


class UnservedError(Exception):
    """An instrument that cannot be put on the bench or served: its name, and as its cause what went wrong."""

    def __init__(self, name: str, cause: Exception) -> None:
        self.name = name
        super().__init__(f"{name}: {type(cause).__name__}: {cause}")


@contextmanager
def _naming(name: str) -> Iterator[None]:
    """Say of which instrument an error of the block is; a port that cannot be had is nobody's."""
    try:
        yield
    except OSError:
        raise
    except Exception as error:
        raise UnservedError(name, error) from error


@dataclass(frozen=True)
class QueuedError:
    """An error that an instrument has queued: its `role`, the `message` that it came of and the `error`'s number and text."""

    role: str
    message: str
    error: str


class ServedBench:
    """Serves a bench until it is closed; a context manager.

    `speedup` is how many seconds pass on the bench in one; `host` is where TCP ports listen, the control endpoint's
    excepted, which stays on loopback: at `ports` by name and way (`hislip`, `socket`, `tcp`, `http`), the others one after the other
    from `base_port` on where that is given; `queued_errors` are the errors that SCPI
    instruments have queued, `refused_clients` who was hung up on
    because an endpoint had as many as it serves. `pages` are objects that it gives besides its own, by path. With
    `watchdog_relay` a relay with a watchdog sits in the supply's inhibit input, whose output is off unless it has picked up.
    Clients are waited for with `patience`.
    What else it takes are VirtualBench's arguments. Raises PortError for a port, OSError for a terminal that cannot be had,
    UnservedError for an instrument that cannot be served, UnknownEndpointError for a port of an endpoint that is not there.
    """

    def __init__(
        self,
        motor: VirtualMotor,
        *,
        speedup: float = 1.0,
        host: str = LOOPBACK,
        seed: int = 0,
        ports: Mapping[str, Mapping[str, int]] | None = None,
        base_port: int | None = None,
        pages: Mapping[str, Any] | None = None,
        watchdog_relay: bool = False,
        patience: Patience = PATIENT,
        **bench: Any,
    ) -> None:
        self.clock = PacedClock(speedup)
        self.host = host
        self._seed = seed
        self.queued_errors: SimpleQueue[QueuedError] = SimpleQueue()
        self.refused_clients: SimpleQueue[RefusedClient] = SimpleQueue()
        self._open = ExitStack()
        try:
            self.bench = VirtualBench(motor, seed=seed, clock=self.clock, **bench)
            self._open.callback(self.bench.close)
            loop = LoopThread("virtual-bench")
            self._open.callback(loop.close)
            # What safety hangs on takes no lock that an instrument holds, and has a thread that runs no instrument.
            safety = LoopThread("virtual-bench-safety")
            self._open.callback(safety.close)
            # Whoever sleeps on a thread of its own must wake up before that thread is waited for.
            self._open.callback(self.clock.close)
            plan = PortPlan(ports, base_port)
            given: dict[str, Any] = {"patience": patience, "seed": seed, "refused": self.refused_clients.put}
            self._endpoints = Endpoints(loop, self.clock, self._open, host, plan, **given)
            guarded = Endpoints(safety, self.clock, self._open, host, plan, **given)
            self._can = guarded.can(self.bench.can_channel)
            self._addresses = self._serve()
            #: Emergency stop and door.
            self.contacts = SafetyContacts()
            self._inputs = self._serve_contacts(guarded, safety)
            self._relays = self._serve_relay(guarded, loop) if watchdog_relay else {}
            routes = control_routes(
                self.bench,
                self.clock,
                self._addresses,
                pages or {},
                self.contacts,
                lambda handler: partial(loop.call, handler),
            )
            control = guarded.listen(("control", "http"), JsonService(routes).serve, host=LOOPBACK, patience=PATIENCE)
            plan.check()
            #: Where the control endpoint is.
            self.control = f"http://{LOOPBACK}:{control.port}"
            self._open.callback(self.clock.close)
        except BaseException:
            self._open.close()
            raise

    def addresses(self) -> dict[str, dict[str, Address]]:
        """Return by role every way to reach its instrument; the first one is the one to prefer."""
        return {role: dict(ways) for role, ways in self._addresses.items()}

    def preferred(self) -> dict[str, Address]:
        """Return by role the address to put into a station file."""
        return {role: next(iter(ways.values())) for role, ways in self._addresses.items()}

    def interlocks(self) -> dict[str, dict[str, Any]]:
        """Return by name where each safety contact is read, a closed one being 1."""
        return {name: dict(where) for name, where in self._inputs.items()}

    def watchdog_relays(self) -> dict[str, dict[str, Any]]:
        """Return by name where each relay with a watchdog is reached, and the roles that it takes the energy from."""
        return {name: dict(where) for name, where in self._relays.items()}

    def close(self) -> None:
        """Hang up on everybody and close all endpoints; again is allowed."""
        self._open.close()

    def __enter__(self) -> "ServedBench":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _serve(self) -> dict[str, dict[str, Address]]:
        ways: dict[str, dict[str, Address]] = {}
        for name in self.bench.roles:
            with _naming(name):
                ways[name] = self._ways(name)
        self._endpoints.begin_pulse()
        return ways

    def _ways(self, name: str) -> dict[str, Address]:
        match self.bench.transport(name):
            case "visa":
                instrument: ScpiInstrument = self.bench.instrument(name)
                instrument.on_error = lambda message, error: self.queued_errors.put(
                    QueuedError(name, message, str(error))
                )
                return dict(self._endpoints.scpi(name, instrument))
            case "modbus":
                return dict(self._endpoints.modbus(name, self.bench.instrument(name)))
            case "serial":
                return {"serial": self.bench.address(name)}
            case "can":
                return {"can": self._on_gateway(self.bench.address(name))}
            case "can-fd":
                node = self._on_gateway(self.bench.address(name))
                path = self._endpoints.fdcanusb(self.bench.can_channel)
                return {"can": node, "fdcanusb": f"fdcanusb://{path}?node={node['node_id']}"}
            case other:
                raise ValueError(f"transport {other!r} is unknown; there are {', '.join(get_args(Transport))}")

    def _on_gateway(self, node: Address) -> dict[str, str | int]:
        if isinstance(node, str):
            raise TypeError(f"{node} is no CAN node")
        return {**node, **self._can}

    def _serve_contacts(self, guarded: Endpoints, loop: LoopThread) -> dict[str, dict[str, Any]]:
        line = ModbusLine((InputModule(self.contacts),), self.clock, np.random.default_rng((self._seed, 0x10)))
        address = guarded.modbus_tcp("emergency_stop", line)
        frames = ContactFrames(self.contacts, self.bench.can_channel)
        loop.run(frames.start())
        self._open.callback(lambda: loop.run(frames.stop()))
        return {
            "emergency_stop": {"address": address, "number": 0, "unit": 1},
            "door": {
                "address": f"can://{self._can['interface']}/{self._can['channel']}",
                "frame": FRAME,
                "byte": 0,
                "bit": 1,
            },
        }

    def _serve_relay(self, guarded: Endpoints, loop: LoopThread) -> dict[str, dict[str, Any]]:
        with _naming("supply"):
            supply = self.bench.instrument("supply")
            supply.inhibit(True)
        # The supply is told before any message that comes later; whoever feeds the relay does not wait for it.
        coupler = Bk9000(lambda closed: loop.soon(supply.inhibit, not closed))
        self._open.callback(coupler.close)
        line = ModbusLine((coupler,), self.clock, np.random.default_rng((self._seed, 0x11)))
        address = guarded.modbus_tcp("supply_enable", line)
        return {"supply_enable": {"address": address, "output": 0, "roles": ["supply"]}}
