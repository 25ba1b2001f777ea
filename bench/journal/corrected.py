"""The valid readings of a journal: a corrected value replaces the one typed first."""

from collections.abc import Sequence
from dataclasses import replace

from bench.journal.codec import RecordedEvent
from bench.journal.encoding import dumps
from bench.journal.events.instruments import ReadingTaken
from procedures.core.events import ActionDone, ReadingCorrected


def corrected(events: Sequence[RecordedEvent]) -> list[RecordedEvent]:
    """Return a journal's events, the readings that were corrected later with the values that count."""
    result = list(events)
    for at, recorded in enumerate(events):
        event = recorded.event
        if not isinstance(event, ReadingCorrected) or event.before is None:
            continue
        before = dumps({"value": event.before})
        for place in range(at - 1, -1, -1):
            match result[place].event:
                case ReadingTaken(instrument=event.instrument) as taken if dumps({"value": taken.value}) == before:
                    result[place] = replace(result[place], event=replace(taken, value=event.after))
                    break
                case ActionDone(given=event.before) as done if not event.instrument:
                    result[place] = replace(result[place], event=replace(done, given=event.after))
                    break
    return result
