"""How a run's processes are ended: signals, kills, a stopped container, a process that gets no time."""

import os
import random
import signal
import threading
from collections.abc import Iterator
from time import monotonic

from tests.studies.kills.held_trials import Plan
from tests.studies.kills.peers import is_guardian
from tests.studies.kills.proxy import Disturbance, Proxy
from tests.studies.kills.victim import TRANSPORTS, Victim

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
#: What the run does meanwhile.
WORK = (("readings",), ("commands",), ("wait",), ("compute",))
#: Where an exception of the stop logic is printed and forgotten.
NOWHERE = (("finalizer",), ("weak-callback",), ("collector-callback",))


def plans(draw: random.Random) -> Iterator[Plan]:
    """Give one of each, again and again, with the work meanwhile drawn."""
    while True:
        for count in (1, 2, 3, 4):
            yield Plan(f"{count} signal{'s' * (count > 1)}", *_work(draw), Signals(count))
        for busy in NOWHERE:
            yield Plan("signal into a callback", busy[0], busy, Signals(draw.choice((1, 1, 2, 3))))
        yield Plan("kill -9: run", *_work(draw), kill_run, resumed=draw.random() < 0.3)
        yield Plan("kill -9: guardian", *_work(draw), kill_guardian, guardian_dies=True)
        yield Plan("kill -9: run and guardian", *_work(draw), kill_both, all_die=True, guardian_dies=True)
        yield Plan("container stopped", *_work(draw), stop_container, guardian_dies=True)
        yield Plan(
            "container stopped, supply mute",
            "readings",
            ("readings",),
            stop_deaf,
            "hislip",
            guardian_dies=True,
            heals=True,
        )
        transport = draw.choice(tuple(TRANSPORTS))
        yield Plan(
            "signal while an instrument is mute", transport, ("readings",), mute_and_signal, transport, heals=True
        )
        yield Plan("SIGSTOP, SIGCONT", *_work(draw), freeze, borne=True)
        yield Plan("SIGSTOP, SIGCONT: guardian", *_work(draw), freeze_guardian, borne=True, promised=3.0)
        yield Plan(
            "SIGSTOP, SIGCONT: guardian, interlocks of 0.6 s",
            *_work(draw),
            freeze_guardian,
            borne=True,
            promised=3.0,
            interlock_timeout=0.6,
        )
        yield Plan(
            "errors handled in an inner block",
            "borne",
            ("nested", draw.choice(("0", "2", "15"))),
            nothing,
            borne=True,
            alone=True,
        )
        yield Plan("clock jumps", "readings", ("clock-jumps", str(draw.randrange(1 << 16))), nothing, borne=True)
        transport = draw.choice(tuple(TRANSPORTS))
        busy = ("clock-jumps", str(draw.randrange(1 << 16)))
        yield Plan("clock jumps, instrument mute", transport, busy, mute, transport, heals=True)


def _work(draw: random.Random) -> tuple[str, tuple[str, ...]]:
    busy = draw.choice(WORK)
    return busy[0], busy


class Signals:
    """So many signals of any kind that ends a program, some microseconds apart."""

    def __init__(self, count: int) -> None:
        self._count = count

    def __call__(self, victim: Victim, _: Proxy | None, draw: random.Random) -> float:
        at = monotonic()
        for _number in range(self._count):
            victim.process.send_signal(draw.choice(STOPS))
            for _moment in range(int(10.0 ** draw.uniform(0.0, 4.5))):
                pass
        return at


def kill_run(victim: Victim, _: Proxy | None, _draw: random.Random) -> float:
    at = monotonic()
    victim.process.send_signal(signal.SIGKILL)
    return at


def kill_guardian(victim: Victim, _: Proxy | None, _draw: random.Random) -> float:
    pid, at = victim.guardian_pid, monotonic()
    os.kill(pid, signal.SIGKILL)
    return at


def kill_both(victim: Victim, _: Proxy | None, draw: random.Random) -> float:
    """Both at once, the one or the other a moment earlier."""
    pids, at = [victim.process.pid, victim.guardian_pid], monotonic()
    draw.shuffle(pids)
    for pid in pids:
        os.kill(pid, signal.SIGKILL)
    return at


def stop_container(victim: Victim, _: Proxy | None, draw: random.Random) -> float:
    """End all processes politely at once and for good some time later, as a service manager does."""
    pid, at = victim.guardian_pid, monotonic()
    for number in draw.sample((victim.process.pid, pid), 2):
        os.kill(number, signal.SIGTERM)

    def for_good() -> None:
        victim.process.send_signal(signal.SIGKILL)
        if is_guardian(pid):
            os.kill(pid, signal.SIGKILL)

    timer = threading.Timer(draw.uniform(2.0, 10.0), for_good)
    timer.daemon = True
    timer.start()
    return at


def stop_deaf(victim: Victim, proxy: Proxy | None, draw: random.Random) -> float:
    """The same while the supply does not hear the run any more."""
    assert proxy is not None
    proxy.disturb(Disturbance("mute"))
    return stop_container(victim, proxy, draw)


def mute_and_signal(victim: Victim, proxy: Proxy | None, draw: random.Random) -> float:
    """A stop that comes while the run waits for a reply, or just before."""
    assert proxy is not None
    at = proxy.disturb(Disturbance("mute", draw.choice(("to", "from", "both"))))
    threading.Event().wait(draw.uniform(0.0, 0.6))
    victim.process.send_signal(draw.choice(STOPS))
    return at


def freeze(victim: Victim, _: Proxy | None, draw: random.Random) -> float:
    at = monotonic()
    victim.process.send_signal(signal.SIGSTOP)
    _wake(victim.process.pid, draw.choice((0.1, 0.3, 0.5, 0.7, 1.0, 3.0)))
    return at


def freeze_guardian(victim: Victim, _: Proxy | None, draw: random.Random) -> float:
    pid, at = victim.guardian_pid, monotonic()
    os.kill(pid, signal.SIGSTOP)
    _wake(pid, draw.choice((0.3, 1.0, 4.0)))
    return at


def _wake(pid: int, after: float) -> None:
    def wake() -> None:
        try:
            os.kill(pid, signal.SIGCONT)
        except ProcessLookupError:
            return

    timer = threading.Timer(after, wake)
    timer.daemon = True
    timer.start()


def nothing(_victim: Victim, _: Proxy | None, _draw: random.Random) -> float:
    return monotonic()


def mute(_victim: Victim, proxy: Proxy | None, draw: random.Random) -> float:
    assert proxy is not None
    return proxy.disturb(Disturbance("mute", draw.choice(("to", "from", "both"))))
