"""A person at a terminal: every action in plain words, Enter when it is done."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, overload

from bench.operators.entry import TypedEntry, TypedReading, checked_number, told
from bench.operators.typed import BACK, narrow, parted, typed_number
from bench.operators.typed_lines import TypedLines
from bench.safety.interrupts import Interrupted, Interrupts
from drivers.interfaces.text import Text, Translate, text, text_of
from drivers.manual.prompt import Option
from procedures.core.actions import (
    ChangeSetup,
    DoubtReading,
    EnterCommand,
    EnterReading,
    HandWork,
    MarkRestPositions,
    Mend,
)
from procedures.core.bench import Operator
from procedures.core.short_number import short
from reports.labels import role_name

if TYPE_CHECKING:
    from rich.console import Console


#: What a person types who does not want to go on.
_NO = ("n", "no", "否")
#: And one who confirms.
_YES = ("y", "yes", "是")
#: What says that it is done, besides Enter alone.
_DONE = ("", *_YES, "done", "ok", "完成", "好")


class TerminalOperator:
    """Prints each action in the reader's language and waits; readings are asked again until they make sense.

    `ask` shows a question and returns the line typed (default: the terminal). `colours` are the motor's wires.
    A question ends when a stop is requested of `interrupts`. `hands` perform what a person confirms where the bench is a virtual one.
    """

    def __init__(
        self,
        console: "Console",
        translate: Translate,
        colours: Mapping[str, str],
        ask: Callable[[str], str] | None = None,
        *,
        interrupts: Interrupts | None = None,
        hands: Operator | None = None,
    ) -> None:
        self._console = console
        self._translate = translate
        self._colours = colours
        self._ask = ask
        self._hands = hands
        self._typed_lines = TypedLines()
        self._interrupts = interrupts or Interrupts()
        self.entry = TypedEntry()

    def perform(self, action: HandWork) -> object:
        """Say what to do and wait until it is done; return the reading typed, or the angles in rad."""
        if isinstance(action, EnterCommand):
            return self._command(action)
        if isinstance(action, EnterReading):
            if self._hands is not None:
                seen = self._hands.perform(action)
                self._say(text("The virtual operator reads {seen:.6g} {unit}", seen=seen, unit=action.unit))
            return self.number(action.quantity, action.unit, action.minimum, action.maximum)
        if isinstance(action, DoubtReading):
            self._say(action.finding)
            asked = text("Press Enter to enter it again, or type y to confirm it as it is")
            return self._correctable(asked).lower() not in _YES
        from rich.table import Table

        lines = [line.render(self._translate) for line in action.lines(self._colours)]
        self._console.print(f"\n[bold]▶ {_plain(lines[0])}[/bold]")
        rows = Table.grid(padding=(0, 1), pad_edge=False)
        for number, line in enumerate(lines[1:], 1):
            rows.add_row(f"   {number}." if isinstance(action, ChangeSetup) else "   ", _plain(line))
        if rows.row_count:
            self._console.print(rows)
        if self._hands is not None:
            self._wait(self._correctable)
            return self._hands.perform(action)
        if isinstance(action, Mend):
            return self._mended()
        if isinstance(action, MarkRestPositions):
            return self._angles(text("angles in degrees, separated by spaces"))
        self._wait(self._correctable)
        return None

    def number(self, quantity: Text, unit: str, minimum: float, maximum: float) -> float:
        """Ask for a number in `unit` within `minimum` … `maximum`, again and again until it is one."""
        question = EnterReading("", quantity, unit, minimum, maximum).sentence()
        if not unit:
            question = text(
                "Enter {quantity} ({minimum} … {maximum})",
                quantity=quantity,
                minimum=short(minimum),
                maximum=short(maximum),
            )
        return self._number(question, quantity, unit, minimum, maximum)

    def choice(self, quantity: Text, options: Sequence[Option]) -> float:
        """Ask for one of the options, again and again until it is one; return its number."""
        numbers = [option.number for option in options]
        question = text("Choose {quantity}: {options}", quantity=quantity, options=[*map(told, options)])
        return self._number(question, quantity, "", min(numbers), max(numbers), options)

    def _number(
        self, question: Text, quantity: Text, unit: str, minimum: float, maximum: float, options: Sequence[Option] = ()
    ) -> float:
        known = self.entry.known(quantity, unit, minimum, maximum, options)
        while known is None:
            typed, refused = self._correctable(question), None
            try:
                known = checked_number(typed, unit, minimum, maximum, options)
            except ValueError as fault:
                refused = text_of(fault)
                self._say(refused)
            self.entry.typed(quantity, unit, minimum, maximum, typed, known, refused, options)
        return known

    def _correctable(self, question: Text) -> str:
        """Return the line typed; before that, earlier readings may be corrected."""
        while readings := self.entry.readings:
            typed = self._line(text("{question}; < corrects an earlier reading", question=question))
            if narrow(typed) != BACK:
                return typed
            self._correct(readings)
        return self._line(question)

    def _correct(self, readings: Sequence[TypedReading]) -> None:
        """Have one of the readings corrected, where a person goes through with it. Raises CorrectedError or RepeatRequestedError then."""
        for number, reading in enumerate(readings, 1):
            self._console.print(f"   {number}. {_plain(_worded(reading).render(self._translate))}", soft_wrap=True)
        typed = self._line(text("Which one? Its number, or Enter for none"))
        if not typed:
            return
        if not (typed.isascii() and typed.isdigit() and 0 < int(typed) <= len(readings)):
            self._say(text("'{typed}' is none of the numbers 1 … {count}", typed=typed, count=len(readings)))
            return
        chosen = readings[int(typed) - 1]
        while typed := self._line(text("The right value, or Enter to leave it: {reading}", reading=_worded(chosen))):
            try:
                reading, value = self.entry.checked(chosen.number, typed)
            except ValueError as fault:
                self._say(text_of(fault))
                continue
            self._say(self.entry.correct(reading, value, typed))
            again = text(
                "Press Enter to leave the reading as it is, or type y to repeat the procedure from its beginning"
            )
            if self._line(again).lower() in _YES:
                self.entry.repeat()
            return

    def confirm(self, instrument: str, task: Text) -> None:
        """Say what to do to an instrument and wait until it is done."""
        message = f"{role_name(instrument).render(self._translate)}: {task.render(self._translate)}"
        self._console.print(f"\n[bold]▶ {_plain(message)}[/bold]")
        self._wait(self._line)

    def _wait(self, ask: Callable[[Text], str]) -> None:
        """Return once somebody says that it is done; a no, or a reading typed too early, is no such word."""
        while (typed := ask(text("Done? Press Enter"))).lower() not in _DONE:
            if typed.lower() in _NO:
                self._say(text("The run waits until this is done; Ctrl-C ends the run and switches everything off"))
            else:
                self._say(
                    text(
                        "no input is needed here, and '{typed}' is not stored: press Enter when the work is done",
                        typed=typed,
                    )
                )

    def _mended(self) -> bool:
        """Return whether it is corrected; a serial number that a scanner types is no answer."""
        asked = text("Corrected? Press Enter to measure again, or type n to give up")
        while (typed := self._line(asked)).lower() not in (*_DONE, *_NO):
            self._say(text("'{typed}' is no answer here", typed=typed))
        return typed.lower() in _DONE

    def _command(self, action: EnterCommand) -> str | None:
        """Say what came of the command before and what is on; return the next one, None where none came in time."""
        said = _plain(action.said.render(self._translate))
        self._console.print(f"[yellow]{said}[/yellow]" if action.refused else said, soft_wrap=True)
        for words in action.on:
            on = text("ON: {typed}", typed=words).render(self._translate)
            self._console.print(f"[bold red]⚡ {_plain(on)}[/bold red]", soft_wrap=True)
        while True:
            typed = self._line(text("Command (help, off, finish)"), action.idle)
            if typed != "":
                return typed

    def _angles(self, question: Text) -> list[float]:
        while True:
            typed = self._correctable(question)
            try:
                values = [typed_number(word, "°") for word in parted(typed)]
            except ValueError:
                values = []
            if values:
                return [math.radians(value) for value in values]
            self._say(text("'{typed}' is not a list of angles; type them like 10 100.5 190 280", typed=typed))

    @overload
    def _line(self, question: Text) -> str: ...

    @overload
    def _line(self, question: Text, patience: float | None) -> str | None: ...

    def _line(self, question: Text, patience: float | None = None) -> str | None:
        """Return the line typed, None where none came within `patience` (s)."""
        asked = question.render(self._translate) + ": "
        try:
            line = self._ask(asked) if self._ask else self._typed(asked, patience)
            return None if line is None else line.strip()
        except EOFError:
            # A signal that came first is what ended the run.
            self._interrupts.check()
            raise Interrupted(text("the end of the input")) from None

    def _say(self, message: Text) -> None:
        self._console.print(f"[yellow]{_plain(message.render(self._translate))}[/yellow]")

    def _typed(self, question: str, patience: float | None) -> str | None:
        # The question goes where the console writes: with --json the standard output carries the result alone.
        self._console.print(_plain(question), end="")
        with self._interrupts.waiting():
            return self._typed_lines.next(patience)


def _worded(reading: TypedReading) -> Text:
    chosen = next((told(option) for option in reading.options if option.number == reading.value), None)
    return text("{reading}: {value}", reading=reading.name, value=chosen or short(reading.value, reading.unit))


def _plain(words: str) -> str:
    """Return words that rich prints as they are."""
    return words.replace("[", "\\[")
