"""Other models of an instrument's family, other versions of its firmware, and options with which it must not open."""

from contextlib import AbstractContextManager, nullcontext
from typing import Any

from bench.testing.conformance.found import asked
from bench.testing.conformance.manual import Model
from bench.testing.conformance.played import play
from bench.testing.conformance.report import Checks, same_value
from bench.testing.conformance.session import Trial
from bench.testing.conformance.stand import OneInstrumentBench


def check_model(trial: Trial, model: Model) -> None:
    """Check what a driver says of another model or with other options, or that it does not open with them."""
    what = " and ".join(str(dict(one)) for one in (model.answers, model.options) if one) or "its options"
    errors = model.error if isinstance(model.error, tuple) else (model.error,)
    refused = trial.checks.refuses(
        f"not opened with {what}", *errors, remedy="Check it when opening", says=(model.says,)
    )
    with refused if errors else nullcontext(), trial.having(**model.options).stand() as made:
        trial.session.prepare(made)
        if model.answers:
            play(made, model.answers)
        before = made.connections
        try:
            instrument = made.open()
        except Exception:
            left, remedy = made.connections - before, "Close the connection of what is not opened"
            trial.checks.that(f"nothing is held of {what}", left <= 0, f"{left} connections are open", remedy)
            raise
        for name, value in model.states.items():
            found = _stated(instrument, name)
            remedy = "Compare with the manual"
            trial.checks.that(f"{name} with {what}", same_value(found, value), f"{found} instead of {value}", remedy)
        for call, error in model.refuses.items():
            name = call if isinstance(call, str) else call[0]
            remedy = "Check before the call what this model has"
            with (
                trial.checks.refuses(f"{name} with {what}", error, remedy=remedy, says=(model.says,)),
                _entered(_stated(instrument, call)),
            ):
                """A block of energy is refused when it begins."""
            trial.checks.that(f"{name} with {what}: nothing is on", not made.energised, "it is on", remedy)
        if model.holds:
            trial.session.brief(made, instrument, Checks())
        for message, value in model.holds.items():
            held = _held(made, message)
            advice = "Compare the setting's unit and step with the manual"
            trial.checks.that(f"{message} with {what}", held == value, f"it holds {held} instead of {value}", advice)
        instrument.close()


def _entered(result: Any) -> AbstractContextManager[Any]:
    return result if isinstance(result, AbstractContextManager) else nullcontext()


def _held(made: OneInstrumentBench, message: str) -> Any:
    """Return what the simulated instrument has, past the driver."""
    if made.transport == "visa":
        return asked(made, message)
    _, *place = message.split()
    if made.transport == "modbus":
        unit, address, count = place
        return tuple(made.simulated.units[int(unit)].read(int(address[:4], 16), int(count)))
    return made.simulated.read(int(place[0][:4], 16))


def _stated(instrument: Any, name: str | tuple[Any, ...]) -> Any:
    """Return what a path leads to: of a method, what it returns when it is called with nothing; of one with arguments, with these."""
    if isinstance(name, tuple):
        return getattr(instrument, name[0])(*name[1:])
    result = instrument
    for part in name.split("."):
        result = result[int(part)] if part.isdigit() else getattr(result, part)
        result = result() if callable(result) else result
    return result
