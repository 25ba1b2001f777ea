"""Trials with a run that holds everything energised: how one goes, whatever is done to it."""

import random
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from bench.cli.station.reset import reset
from tests.studies.kills.proxy import Disturbance, Proxy
from tests.studies.kills.trial import PROMISED, Trial
from tests.studies.kills.victim import ENERGISED, Bench, NeverBegunError, Victim, keep, wait_until_let_go

#: A run that does not begin is started so often.
_STARTS = 3
#: The moment is drawn from so long (s) after everything is on.
_WITHIN = 0.4
#: A disturbance that ends no run: after this time (s) the run is told to stop, and that is what counts.
_BORNE = 1.5
#: A drive's own watchdog takes no longer than this (s).
_WATCHDOG = 5.0
#: How long (s) it is waited for everything to be off before it counts as left on.
_LONGEST = 20.0


@dataclass(frozen=True)
class Plan:
    """One held trial: what the run does (`busy`), what is done to it (`act`), and over which transport.

    `act` returns when (s, monotonic) it disturbed. `borne` says that the run may go on, and is then told to stop; `dies` that
    run and guardian are killed, `guardian_dies` that the guardian is, `alone` that the guardian must have nothing to do with it
    before the run is told to stop. `cut_off` names what nobody can reach any more and only its own
    watchdog switches off. A disturbance that `heals` is over once all is off.
    """

    kind: str
    case: str
    busy: tuple[str, ...]
    act: Callable[[Victim, Proxy | None, random.Random], float]
    transport: str = ""
    borne: bool = False
    all_die: bool = False
    guardian_dies: bool = False
    cut_off: tuple[str, ...] = ()
    resumed: bool = False
    heals: bool = False
    alone: bool = False
    interlock_timeout: float | None = None
    promised: float = PROMISED


def hold(bench: Bench, plan: Plan, draw: random.Random, kept: Path | None = None) -> Trial:
    """Do one trial and return what was found; a run that does not begin is started again, and that is put down."""
    refused: list[str] = []
    while True:
        trial = Trial(plan.kind, plan.case, promised=plan.promised, refused=tuple(refused))
        folder = bench.place(f"{plan.kind} {plan.case}")
        bench.everything_off()
        station, proxy = bench.station(folder, plan.transport, plan.interlock_timeout)
        victim = Victim(bench, folder, station, *plan.busy)
        try:
            victim.energise()
        except NeverBegunError as error:
            _drop(bench, trial, victim, station, proxy)
            refused.append(str(error))
            bench.replace()
            if len(refused) < _STARTS:
                continue
            trial.faults.append(f"did not begin {_STARTS} times: {refused}")
            return trial
        try:
            _try(bench, plan, draw, trial, victim, proxy)
        finally:
            _drop(bench, trial, victim, station, proxy)
        keep(trial, victim, kept)
        return trial


def _try(bench: Bench, plan: Plan, draw: random.Random, trial: Trial, victim: Victim, proxy: Proxy | None) -> None:
    threading.Event().wait(draw.uniform(0.0, _WITHIN))
    trial.energised = bool(bench.truth()["energised"])
    _disturb(bench, plan, draw, trial, victim, proxy)
    if plan.all_die:
        _left_to_themselves(bench, trial)
    ended = victim.ended(trial)
    victim.guardian_left(trial, killed=plan.all_die or plan.guardian_dies)
    victim.examine(trial, ended)
    if plan.resumed or plan.all_die:
        _resume(bench, victim, trial)
    if victim.off_within(_WATCHDOG) is None:
        trial.faults.append(f"energised after the end: {_what_is_on(bench)}")


def _drop(bench: Bench, trial: Trial, victim: Victim, station: Path, proxy: Proxy | None) -> None:
    if proxy is not None:
        proxy.close()
    victim.drop()
    bench.served.mend()
    if victim.run is not None and not wait_until_let_go(victim.run):
        trial.faults.append("its instruments are still held after its end")
    if "the interlock" in "".join(victim.lines[-1:]):
        trial.then += ", an interlock has tripped"
        reset(station, by="the study")


def _disturb(bench: Bench, plan: Plan, draw: random.Random, trial: Trial, victim: Victim, proxy: Proxy | None) -> None:
    queues = victim.queues()
    at = plan.act(victim, proxy, draw)
    if plan.all_die:
        return
    off = victim.off_within(_BORNE if plan.borne else _LONGEST, plan.cut_off)
    if off is None and plan.borne and not plan.alone and victim.is_ending:
        # It has met the disturbance and not borne it.
        off = victim.off_within(_LONGEST, plan.cut_off)
    elif off is None and plan.borne:
        trial.borne = True
        if plan.alone and victim.helped:
            trial.faults.append(f"the guardian has switched off what nobody wanted off: {victim.helped}")
        queues, at = victim.queues(), monotonic()
        victim.process.send_signal(signal.SIGTERM)
        off = victim.off_within(_LONGEST, plan.cut_off)
    if off is None:
        trial.faults.append(f"left energised: {_what_is_on(bench)}")
        trial.off_after = float("inf")
        victim.stacks(trial)
        return
    if proxy is not None and proxy.counted_from < off:
        at = max(at, proxy.counted_from)
    trial.off_after, trial.starved, trial.looked_late = off - at, queues.longest(), victim.looked_late
    if proxy is not None and trial.energised and trial.off_after < _BORNE:
        # A run that calls no more leaves no call without an answer: what lasts longer counts from the disturbance.
        trial.unanswered = proxy.longest_wait(off)
    if plan.heals:
        bench.served.mend()
        if proxy is not None:
            proxy.disturb(Disturbance("none"))


def _left_to_themselves(bench: Bench, trial: Trial) -> None:
    """Nobody is left: drives go off by their own watchdogs, what has none stays on."""
    began = monotonic()
    while bench.truth()["inverter_enabled"] and monotonic() - began < _WATCHDOG:
        threading.Event().wait(0.01)
    truth = bench.truth()
    trial.off_after = monotonic() - began
    if truth["inverter_enabled"]:
        trial.faults.append("the inverter's own watchdog has not switched it off")
    trial.without_computer = f"on until the resume: {_what_is_on(bench)}"


def _what_is_on(bench: Bench) -> str:
    truth = bench.truth()
    return ", ".join(key for key in ENERGISED if truth[key]) or "nothing"


def _resume(bench: Bench, victim: Victim, trial: Trial) -> None:
    """Go on with the run, whose first deed must be to switch everything off."""
    assert victim.run is not None
    wait_until_let_go(victim.run)
    again = Victim(bench, victim.folder, victim.station, "finish", resume=str(victim.run))
    try:
        began = monotonic()
        off = again.off_within(_LONGEST)
        ended = again.ended(trial)
        trial.resumed = str(ended.get("status", "no answer"))
        if off is None or trial.resumed != "completed":
            trial.faults.append(f"the resumed run: {ended or again.said[-300:]}")
        elif trial.without_computer:
            trial.without_computer += f" (off {off - began:.1f} s after it was started)"
        again.guardian_left(trial)
    finally:
        again.drop()
