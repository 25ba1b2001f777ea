"""From whatever state to a harmless one: an ordered list, each item on its own, each outcome recorded."""

from collections.abc import Mapping
from dataclasses import dataclass

from drivers.interfaces import Instrument
from procedures.bench import Recorder, Role

#: What feeds energy goes first, what only listens last.
ORDER: tuple[Role, ...] = (
    Role.SUPPLY,
    Role.INVERTER,
    Role.DRIVE,
    Role.DYNAMOMETER,
    Role.LCR_METER,
    Role.OSCILLOSCOPE,
    Role.TACHOMETER,
    Role.VOLTMETER,
)


@dataclass(frozen=True)
class Outcome:
    """What became of one instrument on the way down; `error` is empty where it is safe."""

    role: Role
    error: str = ""


def make_safe(instruments: Mapping[Role, Instrument], recorder: Recorder) -> list[Outcome]:
    """Bring every instrument to its harmless state; one that fails does not keep the next from being reached."""
    outcomes = []
    for role in ORDER:
        instrument = instruments.get(role)
        if instrument is None:
            continue
        error = ""
        try:
            instrument.make_safe()
        except BaseException as failure:  # noqa: BLE001  not even an interrupt may keep the next instrument on
            error = f"{type(failure).__name__}: {failure}"
        outcomes.append(Outcome(role, error))
        _record(recorder, role, error)
    return outcomes


def _record(recorder: Recorder, role: Role, error: str) -> None:
    try:
        recorder.event("made_safe", instrument=role.value, outcome="failed" if error else "safe", error=error)
    except OSError:
        # A full disk must not keep the next instrument on; the outcome is still returned to the caller.
        return
