"""The attempts at each procedure of a run, from its journal."""

from collections.abc import Collection, Iterable, Mapping, Sequence

from bench.journal.codec import RecordedEvent
from bench.journal.events.instruments import InstrumentCall, ReadingTaken
from bench.journal.events.run import ProcedureFinished, ProcedureStarted
from procedures.core.earlier_call import EarlierAttempt, EarlierCall


def attempts_of(events: Iterable[RecordedEvent], names: Collection[str]) -> Mapping[str, Sequence[EarlierAttempt]]:
    """Return the attempts at procedures by name, oldest first; an attempt after a finished one starts the list again.

    A procedure without one is left out.
    """
    made: dict[str, list[list[EarlierCall]]] = {}
    ended: set[str] = set()
    calls: list[EarlierCall] | None = None
    for recorded in events:
        match recorded.event:
            case ProcedureStarted(procedure=name):
                calls = None
                if name in names:
                    before = [] if name in ended else made.get(name, [])
                    ended.discard(name)
                    calls = []
                    made[name] = [*before, calls]
            case ProcedureFinished(result=result):
                ended.add(result.procedure)
            case InstrumentCall() as call if calls is not None:
                value = call.value if isinstance(call, ReadingTaken) else None
                calls.append(EarlierCall(call.instrument, call.call, tuple(call.arguments), value))
    return made
