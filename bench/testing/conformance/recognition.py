"""Checks of recognition: a driver recognises its own instrument and no other."""

import math
from typing import Any

from bench.testing.conformance.report import Checks, in_words
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.recognition import CanFdTalk, CanOpenProfile, ModbusUnit, ScpiIdentity, SerialTalk
from drivers.transport.modbus.line import client_for
from sim_instruments.instruments.registers import RegisterError

_KNOWN = "Compare what it is recognised by with what it says"
_OTHER = "Recognise nothing but the driver's own instruments"
#: What another instrument says.
_STRANGER = b"ACME,MODEL 1,0,0.0"
_DEVICE_TYPE, _OTHER_PROFILE = 0x1000, 0x00000191


def check_recognition(trial: Trial) -> None:
    """Check each thing that the driver is recognised by, before the simulated instrument."""
    for known in trial.subject.driver.recognised_by:
        with trial.stand() as made:
            trial.session.prepare(made)
            match known:
                case ScpiIdentity():
                    _scpi(made, known, trial.checks)
                case ModbusUnit():
                    _unit(trial, made, known)
                case CanOpenProfile():
                    _profile(made, known, trial.checks)
                case SerialTalk():
                    _talk(made, known, trial.checks)
                case CanFdTalk():
                    _frames(made, known, trial.checks)


def _others(checks: Checks, recognised: Any, *more: Any) -> None:
    for other in (*checks.manual.others, *more):
        recognition = recognised(other)
        checks.that("recognised: nothing else is", not recognition, f"{other!r} is taken for {recognition}", _OTHER)


def _scpi(made: OneInstrumentBench, known: ScpiIdentity, checks: Checks) -> None:
    made.simulated.write(b"*IDN?\n")
    reply = bytes(made.simulated.read(200, 1.0)[0]).decode("latin-1").strip()
    instrument = made.open()
    same = known.identity_of(reply) == instrument.identity
    checks.that("recognised", same, f"{known.identity_of(reply)} of {reply}", _KNOWN)
    instrument.close()
    _others(checks, known.identity_of, _STRANGER.decode(), reply.partition(",")[0], "")


def _unit(trial: Trial, made: OneInstrumentBench, known: ModbusUnit) -> None:
    checks, options = trial.checks, trial.subject.options
    number = getattr(options, known.option)
    for unit, device in made.simulated.units.items():
        registers = _registers(device, known)
        recognition = known.recognise(registers)
        checks.that(
            "recognised", bool(recognition) is (unit == number), f"unit {unit} is taken for {recognition}", _KNOWN
        )
        if unit == number:
            checks.that("recognised: in words", in_words(recognition), f"{recognition}", "Say what it is in words")
            for first, _ in known.reads:
                if first in registers:
                    # What lacks a block of registers is another instrument.
                    left = {address: words for address, words in registers.items() if address != first}
                    _others(checks, known.recognise, left)
    _others(checks, known.recognise, {})
    for framing in known.framings:
        try:
            settings = client_for(f"rtu:///dev/ttyS99?{framing}", 1.0).comm_params
            stop = settings.stopbits in (1, 2) and not math.isnan(settings.baudrate)
            wrong = f"{framing} has {settings.stopbits} stop bits"
        except ValueError as error:
            stop, wrong = False, f"{framing}: {error}"
        checks.that("recognised: its framings can be had", stop, wrong, "Write it as an address has it")


def _registers(device: Any, known: ModbusUnit) -> dict[int, tuple[int, ...]]:
    result = {}
    for first, count in known.reads:
        try:
            result[first] = tuple(device.read(first, count))
        except RegisterError:
            continue
    return result


def _profile(made: OneInstrumentBench, known: CanOpenProfile, checks: Checks) -> None:
    entry = next(one for one in made.simulated.entries if one.index == _DEVICE_TYPE)
    checks.that("recognised", known.matches(int(entry.value)), f"{entry.value:08X}", _KNOWN)
    _others(checks, known.matches, _OTHER_PROFILE)


def _talk(made: OneInstrumentBench, known: SerialTalk, checks: Checks) -> None:
    stream = made.stream(str(made.bench.address(made.subject.role.value)))
    if known.question:
        stream.write(known.question)
    heard = b""
    end = made.bench.clock.now() + known.wait
    while made.bench.clock.now() < end:
        heard += stream.read(64, end - made.bench.clock.now())
    stream.close()
    recognition = known.recognise(heard)
    checks.that("recognised", in_words(recognition), f"{recognition} of {heard!r}", _KNOWN)
    _others(checks, known.recognise, b"", _STRANGER, bytes(reversed(heard)))


def _frames(made: OneInstrumentBench, known: CanFdTalk, checks: Checks) -> None:
    reply = made.simulated.serve(known.question, respond=True)
    instrument = made.open()
    same = known.identity_of(reply) == instrument.identity
    checks.that("recognised", same, f"{known.identity_of(reply)}", _KNOWN)
    instrument.close()
    node = int(made.simulated.node)
    # Nodes answer the source of the question, each by its own number.
    source = known.request >> 8 & 0x7F
    right = len(known.replies) == 126 and known.replies[node - 1] == (node << 8 | source)
    checks.that("recognised: identifiers of the answers", right, f"{known.replies}", _KNOWN)
    _others(checks, known.identity_of, b"", reply[: len(reply) // 2], _STRANGER)
