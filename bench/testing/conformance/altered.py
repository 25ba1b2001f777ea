"""Checks with replies in another format than announced, settings that are not accepted, and frames that arrive in two halves."""

import re
from ast import literal_eval
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from bench.testing.conformance.disturbed import one_use
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import InstrumentError
from sim_instruments.faults.line_faults import Fault, FaultKind

_FRAME = "frame"


def check_altered(trial: Trial) -> None:
    """Check that the driver reports replies in another format than announced, and a setting that the instrument did not accept."""
    traffic: list[tuple[str, str]] = []
    feeds = trial.subject.role.feeds
    with trial.opened(traffic=lambda direction, text: traffic.append((direction, text))) as (made, instrument):
        if made.transport not in ("visa", "serial"):
            return
        traffic.clear()
        trial.brief(made, instrument)
        commands = dict.fromkeys(text for direction, text in traffic if direction == "write" and "?" not in text)
        settings = {command: _setting(made, command) for command in commands if feeds}
    replies: dict[str, str] = {}
    for (direction, text), (_, reply) in zip(traffic, [*traffic[1:], ("", "")], strict=True):
        if direction == "write" and "?" in text and "ERR" not in text:
            replies[text] = reply
        elif direction == "read" and text.startswith("b'"):
            replies[_FRAME] = literal_eval(text).decode("latin-1")
    for text, reply in replies.items():
        if text == _FRAME or not any(character > "\x7f" for character in reply):
            many = None if trial.thorough or text == _FRAME else 2
            for altered in list(_malformed(reply, fixed=text == _FRAME))[:many]:
                with _replaced(trial, text, altered) as (made, instrument):
                    one_use(trial, made, instrument, "a malformed reply", f"{text} → {altered.strip()}")
    if _FRAME in replies:
        # Its first half was thrown away with what had come before.
        took = []
        for part in (replies[_FRAME], replies[_FRAME][len(replies[_FRAME]) // 2 :]):
            with _replaced(trial, _FRAME, part) as (made, instrument):
                began = made.bench.clock.now()
                wrong = trial.wrong(made, instrument)
                took.append(made.bench.clock.now() - began)
        remedy = "Wait for the next whole one, and no longer"
        trial.checks.that("the second half of a frame", not wrong, wrong, remedy)
        trial.checks.that("the second half of a frame: in time", took[1] <= 2.1 * took[0], f"{took} s", remedy)
    if feeds:
        written = [text for direction, text in traffic if direction == "write"]
        for text, reply in replies.items():
            before = written[: len(written) - written[::-1].index(text) - 1]
            if any(other.startswith(f"{text.split('?')[0]} ") for other in before):
                _not_read_back(trial, text, reply.strip())
                for pattern, step in trial.checks.manual.steps.items():
                    for shift in (-0.49 * step, 0.49 * step) if re.search(pattern, text) else ():
                        with _read_back(trial, text, f"{float(reply) + shift:.9g}") as (made, instrument):
                            wrong = trial.wrong(made, instrument)
                        advice = f"Allow that to '{text}'"
                        trial.checks.that(f"a setting that is rounded to {step:g}", not wrong, wrong, advice)
        for command, held in settings.items():
            if held:
                _lost(trial, command, held)


def _malformed(reply: str, *, fixed: bool) -> Iterator[str]:
    """Give a reply with one character that cannot be there, in the place of each of its digits' groups.

    Where its length is `fixed`, also with one more and one less of each.
    """
    for found in re.finditer(r"[0-9][0-9.]*", reply):
        places = range(found.start(), found.end()) if fixed else (found.start(),)
        yield from (f"{reply[:place]}?{reply[place + 1 :]}" for place in places)
    if fixed:
        yield from (reply[:2] + reply[1:], reply[:-2] + reply[-3:], reply[:-2] + reply[-1:])
    if "," in reply:
        yield reply.rpartition(",")[0] + "\n"
        yield reply.rstrip("\n") + ",1\n"


@contextmanager
def _replaced(trial: Trial, text: str, reply: str) -> Iterator[tuple[OneInstrumentBench, Any]]:
    with trial.opened() as (made, instrument):
        data = reply.encode("latin-1") if text == _FRAME else reply.rstrip("\n").encode("latin-1") + b"\n"
        made.faults.add(Fault.on(FaultKind.REPLACE, rf"^{re.escape(text)}\r?$", reply=data))
        yield made, instrument


def _not_read_back(trial: Trial, text: str, said: str) -> None:
    """Have a setting read back as another one, once it was set."""
    try:
        level = float(said)
        other = f"{1.0 - level:.0f}" if level in (0.0, 1.0) else f"{level + 0.008:.6E}"
    except ValueError:
        other = "NONE"
    with _read_back(trial, text, other) as (made, instrument):
        remedy = f"Compare what '{text}' says with what was set ({other} was taken for {said})"
        with trial.checks.refuses("a setting that does not read back", InstrumentError, remedy=remedy):
            trial.brief(made, instrument)


@contextmanager
def _read_back(trial: Trial, text: str, other: str) -> Iterator[tuple[OneInstrumentBench, Any]]:
    """Have a query be answered by something else, once the setting was set."""
    header, written = text.split("?")[0], False

    def strikes(_: int, message: str) -> bool:
        nonlocal written
        written = written or message.startswith(f"{header} ")
        return written and message.rstrip("\r") == text

    with trial.opened() as (made, instrument):
        made.faults.add(Fault(FaultKind.REPLACE, strikes, reply=other.encode() + b"\n", times=None))
        yield made, instrument


def _lost(trial: Trial, command: str, held: bytes) -> None:
    """Have a command be lost on its way: what was to be set is read back, or it makes no difference."""
    with trial.opened() as (made, instrument):
        made.answer({f"^{re.escape(command)}$": b""})
        with suppress(InstrumentError):
            trial.brief(made, instrument)
            found = _setting(made, command)
            what, remedy = f"'{command}' was lost, and {found!r} was taken for {held!r}", "Read back what is set"
            trial.checks.that("a setting that is not taken", found == held, what, remedy)


def _setting(made: OneInstrumentBench, command: str) -> bytes:
    """Return what the simulated instrument says of a setting; empty where it has no such question."""
    header, _, value = command.partition(" ")
    channel = re.search(r"\(@[^)]*\)", value)
    made.simulated.write(f"{header}? {channel[0] if channel else ''}".strip().encode() + b"\n")
    try:
        reply = bytes(made.simulated.read(200, 0.1)[0])
    except Exception:  # noqa: BLE001  a command that cannot be asked for
        reply = b""
    made.simulated.write(b"*CLS\n")
    return reply
