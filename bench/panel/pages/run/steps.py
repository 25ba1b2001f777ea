"""Progress of the run: its procedures, each with its state, and warnings in words."""

from nicegui import ui

from bench.panel.live.live_run import LiveRun
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from drivers.interfaces.text import text, word


class ProgressCard:
    """The list of procedures and what was warned of."""

    def __init__(self, panel: Panel, run: LiveRun, reader: Reader) -> None:
        self._panel = panel
        self._run = run
        self._reader = reader
        self._shown: object = None
        with named(ui.element("section").classes("mb-card"), reader.say(text("Progress"))):
            self._motor = ui.label(reader.say(text("This run"))).classes("mb-h2").props("role=heading aria-level=2")
            self._list = ui.element("ol").classes("mb-plan")
            self._warnings = ui.element("div").props("role=log").classes("mt-3")

    def show(self) -> None:
        """Show state of procedures and warnings, where either has changed."""
        view, say = self._run.view, self._reader.say
        if view.run.start is not None:
            motor = view.run.start.motor
            self._motor.set_text(" · ".join(part for part in (motor.name, motor.serial_number) if part))
        states = [(name, self._state(name)) for name in view.run.planned]
        warnings = [f"{say(word(notice.identifier))}: {say(notice.message)}" for _, notice in view.run.warnings()]
        if (states, warnings) == self._shown:
            return
        self._shown = (states, warnings)
        self._list.clear()
        with self._list:
            for name, (mark, words) in states:
                with ui.element("li").classes("mb-now" if mark == "▶" else ""):
                    ui.label(mark).props("aria-hidden=true")
                    ui.label(say(self._panel.offer.title(name)))
                    ui.label(words)
        self._warnings.clear()
        with self._warnings:
            for words in warnings:
                ui.label(f"⚠ {words}").classes("text-base py-1").style("color: var(--warn-ink)")

    def _state(self, name: str) -> tuple[str, str]:
        view, say = self._run.view, self._reader.say
        here = view.run.procedures.get(name)
        if here is None:
            return "·", ""
        if here.result is not None:
            return "✓", say(text("done"))
        if here.cause:
            return "✗", say(text("failed"))
        steps = list(here.sentences)
        if name == view.procedure and view.step in steps:
            return "▶", say(text("{number} of {all}", number=steps.index(view.step) + 1, all=len(steps)))
        return ("▶", say(text("under way"))) if name == view.procedure else ("·", "")
