"""One reading of everything that an instrument measures without feeding or moving anything."""

from collections.abc import Callable, Iterator
from inspect import Parameter
from typing import Any

from drivers.interfaces import InstrumentError, ProbeKind, Role
from drivers.interfaces.declarations import Effect, declarations

#: What is set up before a reading where nothing is read without: 10 V, and a bridge's usual test signal of 1 V at 1 kHz.
_SETTING_UP: dict[Role, dict[str, float]] = {Role.VOLTMETER: {"full_scale": 10.0}, Role.LCR_METER: {"frequency": 1e3}}


def sample(instrument: Any, role: Role) -> Iterator[tuple[str, InstrumentError | None]]:
    """Take each reading that needs no argument, or a channel only; give its name and what the instrument said against it."""
    if role in _SETTING_UP:
        yield "configure", _failed(instrument.configure, **_SETTING_UP[role])
    for name, declaration in declarations(role.interface).items():
        needed = [key for key, default in declaration.arguments.items() if default is Parameter.empty]
        if declaration.effect is not Effect.READING or needed not in ([], ["channel"]):
            continue
        if declaration.ability is not None and declaration.ability not in instrument.abilities:
            continue
        channels = list(instrument.channels(ProbeKind.VOLTAGE)[:1]) if needed else []
        if len(channels) == len(needed):
            yield name, _failed(getattr(instrument, name), *channels)


def _failed(call: Callable[..., object], *arguments: Any, **named: Any) -> InstrumentError | None:
    try:
        call(*arguments, **named)
    except InstrumentError as error:
        return error
    return None
