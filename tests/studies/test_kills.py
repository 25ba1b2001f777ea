"""A few of the study's trials, one of each sort, and that its instruments measure what they say."""

import random
import signal
import socket
import threading
from collections.abc import Iterator
from time import monotonic

import pytest

from tests.studies.kills.ends import STOPS, Signals, kill_both
from tests.studies.kills.held_trials import Plan, hold
from tests.studies.kills.proxy import Disturbance, Proxy
from tests.studies.kills.quick import bursts
from tests.studies.kills.report import good, summary, table
from tests.studies.kills.trial import Trial
from tests.studies.kills.victim import Bench
from tests.studies.kills.wires import Injected, Struck

#: Speed is measured by the study itself: a loaded machine must not fail a test.
SOON = 5.0
PLANS = [
    Plan("callback", "finalizer", ("finalizer",), Signals(3)),
    Plan("kill -9", "run and guardian", ("readings",), kill_both, all_die=True, guardian_dies=True),
    Plan("wire", "mute", ("readings",), Struck(Disturbance("mute", "from")), "hislip", heals=True),
    Plan(
        "Modbus",
        "exception",
        ("readings",),
        Injected({"fault": "exception", "role": "dynamometer", "pattern": "^read"}),
    ),
]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    made = Bench(tmp_path_factory.mktemp("kills"))
    yield made
    made.close()


@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: f"{plan.kind} {plan.case}")
def test_whatever_is_done_to_a_run_everything_is_off_and_nothing_is_lost(bench: Bench, plan: Plan) -> None:
    trial = hold(bench, plan, random.Random(1))  # noqa: S311  chance, not secrecy
    assert trial.energised
    assert trial.off < SOON, trial
    assert (trial.missing, trial.faults) == (0, []), trial
    if plan.all_die or plan.resumed:
        assert trial.resumed == "completed"


def test_quick_bursts_hang_nothing() -> None:
    found = bursts(60, "suite")
    assert (found.bursts, found.hangs, found.found) == (60, 0, [])


class Echo:
    """Answers every piece with itself."""

    def __init__(self) -> None:
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                peer, _ = self._listening.accept()
            except OSError:
                return
            threading.Thread(target=self._answer, args=(peer,), daemon=True).start()

    @staticmethod
    def _answer(peer: socket.socket) -> None:
        with peer:
            while content := peer.recv(1024):
                peer.sendall(content)

    def close(self) -> None:
        self._listening.close()


@pytest.fixture
def proxy() -> Iterator[Proxy]:
    echo = Echo()
    made = Proxy(echo.port)
    yield made
    made.close()
    echo.close()


def asked(proxy: Proxy, connection: socket.socket, seconds: float = 10.0) -> bytes:
    connection.settimeout(seconds)
    connection.sendall(b"abc")
    try:
        return connection.recv(16)
    except TimeoutError:
        return b"nothing"


def refused(connection: socket.socket) -> bool:
    try:
        return connection.recv(16) == b""
    except ConnectionError:
        return True


def test_the_proxy_disturbs_and_tells_how_long_a_call_was_left_without_an_answer(proxy: Proxy) -> None:
    with socket.create_connection(("127.0.0.1", proxy.port)) as run:
        assert asked(proxy, run) == b"abc"
        assert proxy.longest_wait(monotonic()) is None
        proxy.disturb(Disturbance("delay", "from", 0.2))
        assert asked(proxy, run) == b"abc"
        waited = proxy.longest_wait(monotonic())
        assert waited is not None
        assert waited >= 0.2
        proxy.disturb(Disturbance("mute", "to"))
        assert asked(proxy, run, 0.3) == b"nothing"
        assert (proxy.longest_wait(monotonic()) or 0.0) >= 0.2
        proxy.disturb(Disturbance("reset", again=True))
        # A pump that was just reading may end the connection in order, before the reset does.
        assert refused(run)
        with socket.create_connection(("127.0.0.1", proxy.port)) as again:
            assert refused(again)


def test_a_report_has_the_worst_first_and_tells_what_was_missed() -> None:
    right = Trial("right", "a", energised=True, off_after=0.2)
    late = Trial("late", "b", energised=True, off_after=1.4, starved=0.7)
    lost = Trial("lost", "c", energised=True, off_after=0.1, missing=2)
    alone = Trial("alone", "d", energised=True, off_after=9.0, without_computer="on until the resume: output_on")
    assert [trial.good for trial in (right, late, lost, alone)] == [True, False, False, True]
    rows = table([right, lost, late, alone]).splitlines()
    assert [row.split("|")[1].strip() for row in rows[2:]] == ["late", "lost", "alone", "right", "all"]
    words = summary([right, late, lost, alone])
    assert "Off later than promised: 1, in 1 of these cases by no more than" in words
    assert "Events told and not in the journal: 2." in words
    assert good([right, alone])
    assert not good([right, late])


@pytest.mark.parametrize(
    ("said", "traces"),
    [
        ("motorbench: interrupted\n", False),
        (
            "Exception ignored in: <function A.__del__ at 0x1>\nTraceback (most recent call last):\n  File\n"
            "bench.safety.interrupts.Interrupted: interrupted by SIGTERM\nmore\n",
            False,
        ),
        ("Traceback (most recent call last):\n  File\nValueError: 1\n", True),
    ],
)
def test_traces_are_told_from_interruptions_that_python_prints(said: str, traces: bool) -> None:
    trial = Trial("a", "b")
    trial.judge_stderr(said)
    assert bool(trial.faults) is traces


def test_the_signals_are_those_that_end_a_program() -> None:
    assert set(STOPS) == {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
