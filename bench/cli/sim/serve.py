"""`motorbench sim serve`: the virtual bench on real sockets, in a process of its own."""

import gc
import json as json_format
import logging
import os
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.new_file import write_new
from bench.cli.options import Seed
from bench.cli.serving import check_host, check_ports, say_refused, unavailable
from bench.cli.sim.understood import WITH_EVERY_ROLE, print_understood
from bench.i18n.errors import InputError, UsageError
from drivers.interfaces.text import text

#: After so long (s) a thread that computes lets another one go on.
_SWITCH_INTERVAL = 1.0e-3
#: How long (s) a client may be idle.
_SHORTEST_IDLE, _LONGEST_IDLE = 1.0, 1.0e6

if TYPE_CHECKING:
    from sim_instruments.server.served_bench import ServedBench


def serve(
    *,
    motor: str | None = None,
    station: Path | None = None,
    station_file: Path | None = None,
    force: bool = False,
    json: bool = False,
    speedup: float = 1.0,
    seed: Seed = 0,
    host: str = "127.0.0.1",
    faults: Path | None = None,
    fault: tuple[str, ...] = (),
    fixture: bool = False,
    watchdog_relay: bool = False,
    hostile: Seed | None = None,
    disturbances: Path | None = None,
    base_port: int | None = None,
    ports: Path | None = None,
    idle: float | None = None,
    strict: bool = False,
    commands: str | None = None,
) -> int:
    """Serve the virtual bench to other processes until SIGINT or SIGTERM.

    Standard output is a ready station file, the addresses being comments in it; it is flushed before anybody is served.

    Parameters
    ----------
    motor
        A motor file with a table [virtual], or the name of a shipped motor. Required, except with --commands.
    station
        A station file. Each of its instruments, plug-ins included, is served by the simulated instrument that its driver names.
        Default: the standard bench.
    station_file
        Write the station file to this file, and print the addresses only. An existing file with other content is not
        overwritten.
    force
        Overwrite that file.
    json
        Print one JSON object on one line and nothing else.
    speedup
        Seconds on the bench for each real second, 0.1 to 1000.
    seed
        Seed of the instruments' noise and errors.
    host
        The IPv4 address that the TCP ports listen on; the control endpoint always stays on loopback.
    faults
        A file of faults to inject.
    fault
        One fault in a few words, like "supply: silence at 12"; may be given several times.
    fixture
        With an end-of-line fixture: switch matrix, rotor actuator and insulation tester.
    watchdog_relay
        With a watchdog relay. When it drops out, the supply's output is off.
    hostile
        Start with instrument settings that an earlier user could have left, drawn with this seed.
    disturbances
        A file that states what disturbs the virtual bench: errors of probes, shaft sensors, contacts and hands.
    base_port
        First TCP port; the others follow in the order of the addresses. Default: the system chooses the ports.
    ports
        A TOML file of TCP ports by endpoint. The system chooses the ports that it does not state.
    idle
        Seconds without a message after which a client is disconnected, 1 to 1000000. Default: 7200.
    strict
        Exit with status 1 at the first error that a SCPI instrument queues, and name the message that caused it.
    commands
        Serve nothing. Print what the instrument of this role understands: commands and queries, registers, or objects.

    """
    from bench.motor.motor_file import load_motor
    from bench.safety.interrupts import Interrupted, Interrupts
    from bench.station.station_file import catalogues_at
    from bench.virtual.disturbance_file import load_disturbances
    from bench.virtual.fault_file import given_faults
    from bench.virtual.fault_hooks import inject
    from bench.virtual.port_file import load_ports
    from bench.virtual.served_station import station_to_serve
    from bench.virtual.true_values import true_values
    from bench.virtual.virtual_station import bench_size_for, dc_voltage_for, describe
    from procedures.known_parameters import known_parameters
    from sim_instruments.bench import BenchSetting
    from sim_instruments.catalogue import standard_units
    from sim_instruments.clock.paced_clock import FASTEST, SLOWEST
    from sim_instruments.server.endpoints import PATIENT

    if not SLOWEST <= speedup <= FASTEST:
        raise UsageError(
            text(
                "--speedup {speedup:g}: allowed is {slowest:g} to {fastest:g}",
                speedup=speedup,
                slowest=SLOWEST,
                fastest=FASTEST,
            )
        )
    check_host(host)
    check_ports(base_port)
    if idle is not None and not _SHORTEST_IDLE <= idle <= _LONGEST_IDLE:
        raise UsageError(
            text(
                "--idle {idle:g}: allowed is {least:g} to {most:g}", idle=idle, least=_SHORTEST_IDLE, most=_LONGEST_IDLE
            )
        )
    if station is not None and fixture:
        raise UsageError(text("--fixture and --station: the station file says whether there is a fixture"))
    if station is not None and station_file is not None and station.resolve() == station_file.resolve():
        raise UsageError(
            text("--station-file {file}: this is the file given with --station; choose another file", file=station_file)
        )
    if motor is None:
        if commands is None:
            raise UsageError(
                text("--motor is missing: give a motor file with a table [virtual], or the name of a shipped motor")
            )
        motor = WITH_EVERY_ROLE
    given = given_faults(faults, fault)
    procedures = None if station is None else catalogues_at(str(station)).procedures
    read = load_motor(motor, procedures)
    virtual = read.virtual_motor()
    told = {
        "name": read.nameplate.name,
        "source": read.source,
        "truth": true_values(known_parameters(procedures), virtual, read.six_step),
    }
    # Nobody may be reading standard error, and a library that complains into a full pipe would stand still.
    logging.getLogger().addHandler(logging.NullHandler())
    try:
        more: dict[str, Any] = {
            "six_step": read.six_step,
            "fixture": fixture,
            "watchdog_relay": watchdog_relay,
            "hostile": hostile,
        }
        size = bench_size_for(virtual, read.nameplate)
        more["units"] = standard_units(
            six_step=read.six_step is not None,
            fixture=fixture or commands is not None,
            dc_voltage=dc_voltage_for(read.nameplate),
            torque=size.torque,
            inverter_current=size.inverter_current,
        )
        own = None
        if disturbances is not None:
            more["setting"] = BenchSetting(disturbances=load_disturbances(disturbances))
        if station is not None:
            own = station_to_serve(station, read)
            more |= {"units": own.units, "fixture": own.fixture}
        if commands is not None:
            fixture_too = {"fixture": True} if station is None else {}
            print_understood(commands, virtual, {**more, **fixture_too}, json=json)
            return 0
        if base_port is not None:
            more["base_port"] = base_port
        if ports is not None:
            more["ports"] = load_ports(ports)
        if idle is not None:
            more["patience"] = replace(PATIENT, idle=idle)
        interrupts = Interrupts()
        with interrupts.raising(), _opened(virtual, speedup, host, seed, told, more, ports) as bench:
            inject(given, bench.bench.injector.add)
            described = describe(
                bench.preferred(), bench.control, bench.interlocks(), bench.watchdog_relays(), size=size
            )
            _tell(
                bench,
                told,
                described if own is None else own.file(described),
                station_file,
                json=json,
                seed=seed,
                force=force,
            )
            say_refused(bench.refused_clients)
            # Looked through for what could be freed, all that is loaded holds everybody up for 40 ms.
            gc.freeze()
            # The contacts' thread waits no longer than this for one that computes.
            sys.setswitchinterval(_SWITCH_INTERVAL)
            with interrupts.waiting():
                if not strict:
                    threading.Event().wait()
                queued = bench.queued_errors.get()
    except Interrupted:
        # That is how serving ends.
        return 0
    raise InputError(
        text(
            "{role}: error {error} queued by '{message}'; --strict ends here",
            role=queued.role,
            error=queued.error,
            message=queued.message.strip(),
        )
    )


def _opened(
    motor: Any,
    speedup: float,
    host: str,
    seed: int,
    told: dict[str, Any],
    more: dict[str, Any],
    ports: Path | None,
) -> "ServedBench":
    from bench.plugins.catalogue import reason
    from bench.virtual.served_station import unserved
    from sim_instruments.server.port_plan import UnknownEndpointError
    from sim_instruments.server.served_bench import ServedBench, UnservedError

    try:
        return ServedBench(motor, speedup=speedup, host=host, seed=seed, pages={"/motor": told}, **more)
    except UnknownEndpointError as error:
        raise UsageError(
            text(
                "{file}: this bench has no endpoint {name}.{way}; its endpoints are {known}",
                file=ports,
                name=error.name,
                way=error.way,
                known=", ".join(error.known),
            )
        ) from error
    except UnservedError as error:
        raise unserved(error.name, reason(error.__cause__ or error)) from error
    except OSError as error:
        raise unavailable(error, host) from error


def _tell(
    bench: "ServedBench",
    told: dict[str, Any],
    station: dict[str, Any],
    file: Path | None,
    *,
    json: bool,
    seed: int,
    force: bool,
) -> None:
    from tomli_w import dumps as toml_text

    from bench.virtual.virtual_station import as_text

    if file is not None:
        write_new(file, toml_text(station), force=force)
    if json:
        made = {
            "station": station,
            "control": bench.control,
            "addresses": bench.addresses(),
            "motor": told,
            "speedup": bench.clock.speedup,
            "seed": seed,
            **({"left": bench.bench.left} if bench.bench.left else {}),
            "station_file": str(file) if file else None,
            "pid": os.getpid(),
        }
        print(json_format.dumps(made, ensure_ascii=False), flush=True)
        return
    for role, ways in bench.addresses().items():
        for way, address in ways.items():
            print(f"# {role:<13}{way:<7} {as_text(address)}")
    print(f"# {'control':<21}{bench.control}")
    for role, left in bench.bench.left.items():
        print(f"# {role:<13}left as: {'; '.join(left)}")
    print(f"# station file: {file}" if file else toml_text(station), flush=True)
    print(
        f"motorbench: {told['name']} is served at {bench.clock.speedup:g} × real time; Ctrl-C ends it", file=sys.stderr
    )
