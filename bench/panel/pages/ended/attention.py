"""Recommended actions after a run, the most important first."""

from collections.abc import Awaitable, Callable, Sequence

from nicegui import ui

from bench.panel.pages.parts import expansion, named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text
from reports.tables.attention import Attention, Rank, is_erratum

#: Findings of one rank that stand open; the rest is unfolded.
_SHOWN = 6


class AttentionPart:
    """The list; `title` names a procedure, `repeat` measures it again, None where nobody here may."""

    def __init__(
        self, reader: Reader, title: Callable[[str], Text], repeat: Callable[[str], Awaitable[None]] | None
    ) -> None:
        self._reader = reader
        self._title = title
        self._repeat = repeat

    def build(self, found: Sequence[Attention], repeatable: Sequence[str]) -> None:
        """Build it; nothing where there is nothing to say."""
        if not found:
            return
        say = self._reader.say
        to_do = [each for each in found if each.rank is not Rank.KNOWN]
        known = [each for each in found if each.rank is Rank.KNOWN]
        heading = say(text("What to do, most important first"))
        with named(ui.element("section").classes("mb-card mb-4"), heading):
            ui.label(heading).classes("text-lg font-semibold").props("role=heading aria-level=2")
            if not to_do:
                ui.label(say(text("Nothing."))).classes("text-base")
            for each in to_do[:_SHOWN]:
                self._one(each, repeatable)
            for title, rest in (
                (text("{count} more", count=len(to_do[_SHOWN:])), to_do[_SHOWN:]),
                (text("For your information, nothing to do: {count}", count=len(known)), known),
            ):
                if rest:
                    with expansion(say(title)):
                        for each in rest:
                            self._one(each, repeatable)

    def _one(self, each: Attention, repeatable: Sequence[str]) -> None:
        say = self._reader.say
        mark, meaning = {
            Rank.MISSING: ("✗", text("not given")),
            Rank.CONTRADICTION: ("⚠", text("contradiction")),
            Rank.CONDITION: ("⚠", text("warning")),
            Rank.KNOWN: ("i", text("information")),
        }[each.rank]
        finding = ui.element("div").classes("mb-finding")
        finding.props["data-rank"] = each.rank.name.lower()
        with finding:
            named(ui.label(mark).props("role=img").classes("mb-finding-mark"), say(meaning))
            with ui.element("div").classes("grow min-w-0"):
                ui.label(say(each.message)).classes("text-base")
                origin = [say(self._title(each.procedure))] if each.procedure else []
                # Names that a program knows a finding by say nothing to its reader.
                erratum = [each.identifier] if is_erratum(each.identifier) else []
                ui.label(" · ".join(origin + erratum)).classes("mb-small")
            if self._repeat is not None and each.procedure in repeatable and each.rank is not Rank.KNOWN:
                repeat, procedure = self._repeat, each.procedure
                button = ui.button(say(text("Repeat")), on_click=lambda: repeat(procedure)).props("outline no-caps")
                named(button, say(text("Repeat {procedure}", procedure=self._title(procedure))))
