"""Readings from a file instead of from a person: the same procedures, replayed."""

import math
import re
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.files.toml_file import nearest, read
from bench.i18n.errors import FileError
from drivers.interfaces.text import Text, text
from drivers.manual.prompt import Option
from procedures.core.actions import FINISH, YES, EnterCommand, EnterReading, HandWork, MarkRestPositions
from procedures.core.bench import Operator, ProcedureError
from procedures.core.events import Event, RepeatStarted, StepStarted

#: The key of the marked angles of `MarkRestPositions`.
ANGLES_KEY = "rest_positions_deg"
_KEYS = ("readings", "commands")


class Answers:
    """Lists of answers by what is asked, each used up from its start.

    `[readings]` of the file maps the key of a reading to a number, a list of numbers, or for marked angles a list of lists.
    A table in it, named by an instrument's role, holds what is read off that instrument: `readings.tachometer.speed`.
    `commands` of the file are those of a run by hand, a line each.
    """

    def __init__(self, answers: Mapping[str, Any], source: str, commands: Sequence[str] = ()) -> None:
        self._source = source
        self._step, self._again = "", False
        #: By key, what was asked once more, because the reading before it was doubted.
        self._doubted: dict[str, list[Text]] = {}
        self._commands = iter(commands)
        self._left: dict[str, deque[Any]] = {}
        for key, given in _flat(answers):
            items = given if isinstance(given, list) else [given]
            if key == ANGLES_KEY and items and not isinstance(items[0], list):
                items = [items]
            for item in items:
                numbers = item if isinstance(item, list) else [item]
                if any(isinstance(number, bool) or not isinstance(number, int | float) for number in numbers):
                    raise FileError(
                        text(
                            "{source}: readings.{key} = {item}; give numbers without units",
                            source=source,
                            key=key,
                            item=repr(item),
                        )
                    )
            self._left[key] = deque(items)
        self._count = {key: len(left) for key, left in self._left.items()}
        self._where: Text | None = None
        self._first_count = 1

    def next(self, key: str, asked: str) -> Any:
        """Return the next answer to `key`; ProcedureError names what was `asked` where there is none or none is left."""
        if key not in self._left:
            known = nearest(key, list(self._left)) if self._left else text("the file has none")
            raise ProcedureError(
                text(
                    "{source} has no answers for {key}, which was asked as '{asked}'; {known}",
                    source=self._source,
                    key=key,
                    asked=asked,
                    known=known,
                )
            )
        taken = self._count[key] - len(self._left[key]) + 1
        if self._again:
            place = text("number {number} ({where})", number=taken, where=self._where or asked)
            self._doubted.setdefault(key, []).append(place)
        if not self._left[key]:
            raise ProcedureError(self._run_out(key, asked, taken))
        return self._left[key].popleft()

    def _run_out(self, key: str, asked: str, number: int) -> Text:
        message = text(
            "{source}: the answers for {key} have run out; still asked is '{asked}'{where}. Add number {number} to readings.{key}",
            source=self._source,
            key=key,
            asked=asked,
            where=text(", at {where}", where=self._where) if self._where else "",
            number=number,
        )
        if not (doubted := self._doubted.get(key)):
            return message
        return text(
            "{said}. A reading that contradicts the others of its series is taken once more and needs one more "
            "answer. Insert that answer as {places}, so that the following answers keep their places, or correct "
            "the reading that was doubted",
            said=message,
            places=doubted,
        )

    def hear(self, event: Event) -> None:
        """Take an event of the journal: which step asks, and whether it asks once more."""
        if isinstance(event, StepStarted):
            self._step, self._where, self._again = event.step, text("step {step}", step=event.step), False
        elif isinstance(event, RepeatStarted):
            self._again = event.again or event.number > self._planned(event)
            self._where = text(
                "step {step}, {terminals}, reading {number} of {count}",
                step=self._step,
                terminals=event.terminals,
                number=event.number,
                count=event.count,
            )

    def _planned(self, event: RepeatStarted) -> int:
        """Return how many readings were wanted at first: one that is read once more raises their count."""
        if event.number == 1:
            self._first_count = event.count
        return self._first_count

    def command(self) -> str:
        """Return the next command, the one that ends where none is left."""
        return next(self._commands, FINISH)


def _flat(answers: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, given in answers.items():
        if isinstance(given, dict):
            yield from ((f"{key}.{inner}", value) for inner, value in _flat(given))
        else:
            yield key, given


def load_answers(path: Path) -> Answers:
    """Read an answers file. Raises InputError where it is not one."""
    _, data = read(path, text("answers file"))
    for key in data:
        if key not in _KEYS:
            raise FileError(text("{path}: unknown key {key}; {hint}", path=path, key=key, hint=nearest(key, _KEYS)))
    commands = data.get("commands", [])
    if not isinstance(commands, list) or not all(isinstance(one, str) for one in commands):
        raise FileError(
            text(
                "{path}: commands = {given}; allowed is a list of texts, a command each",
                path=path,
                given=repr(commands),
            )
        )
    readings = data.get("readings", {})
    if not isinstance(readings, dict):
        raise FileError(
            text("{path}: readings = {given}; allowed is a table [readings]", path=path, given=repr(readings))
        )
    return Answers(readings, str(path), commands)


class AnswersOperator:
    """Confirms every action as done, and takes every reading and command from the file.

    `hands` do the hand work where the bench is a virtual one.
    """

    def __init__(self, answers: Answers, hands: Operator | None = None) -> None:
        self._answers = answers
        self._hands = hands

    def perform(self, action: HandWork) -> object:
        """Answer a reading or the marked angles (degrees in the file, rad returned); everything else is done at once."""
        if isinstance(action, EnterReading):
            value = float(self._answers.next(action.key, action.sentence().render()))
            if not action.minimum <= value <= action.maximum:
                raise ProcedureError(
                    text(
                        "the answer {value:g} to {key} is outside {minimum:g} … {maximum:g} {unit}",
                        value=value,
                        key=action.key,
                        minimum=action.minimum,
                        maximum=action.maximum,
                        unit=action.unit,
                    )
                )
            if action.usual is not None and not action.usual[0] <= value <= action.usual[1]:
                low, high = action.usual
                raise ProcedureError(
                    text(
                        "the answer {value:g} {unit} to {key} is unusual (usual are {low:g} … {high:g} {unit}), "
                        "and a file cannot be asked again; correct it, or give it as a setting of the procedure",
                        value=value,
                        key=action.key,
                        low=low,
                        high=high,
                        unit=action.unit,
                    )
                )
            return value
        if isinstance(action, MarkRestPositions):
            degrees = self._answers.next(ANGLES_KEY, action.sentence().render())
            return [math.radians(angle) for angle in degrees]
        if isinstance(action, EnterCommand):
            return YES if action.confirms else self._answers.command()
        return self._hands.perform(action) if self._hands else None


class AnswersPrompt:
    """Answers what instruments set and read by hand ask for; everything to be done is done at once."""

    def __init__(self, answers: Answers, instrument: str) -> None:
        self._answers = answers
        self._instrument = instrument

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        """Return the next answer to `role.quantity`; the driver itself checks its range."""
        asked = f"{self._instrument}: {quantity}{f' in {unit}' if unit else ''} {context or ''}".strip()
        return float(self._answers.next(f"{self._instrument}.{quantity_key(str(quantity))}", asked))

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        """Return the next answer to `role.quantity`; the driver itself checks that it is one of the options."""
        return self.ask(quantity, "", min(one.number for one in options), max(one.number for one in options), None)

    def confirm(self, task: Text) -> None:
        """Say that it is done."""


def quantity_key(quantity: str) -> str:
    """Return a quantity's key in an answers file: `resistance Rs` is `resistance`, `electrical frequency` is `electrical_frequency`."""
    words = re.split(r"[,:]", quantity)[0].split()
    kept = [word for word in words if word == word.lower()] or words
    return re.sub(r"\W+", "_", "_".join(kept)).strip("_").lower()
