"""What a run came to."""

from nicegui import ui

from bench.errors import InputError
from bench.panel.live_run import LiveRun
from bench.panel.pages.frame import Reader
from bench.panel.pages.tables import html_table
from bench.panel.panel import Panel
from bench.panel.sessions import Session
from procedures.text import text
from reports.summary import rows

_STATUS = {
    "completed": text("completed"),
    "failed": text("failed"),
    "aborted": text("was aborted"),
    "interrupted": text("was interrupted"),
}


def ended_part(panel: Panel, session: Session, run: LiveRun, reader: Reader) -> None:
    """Build the results of a run that has ended."""
    say, view = reader.say, run.view.run
    motor = view.start.get("motor", {})
    ui.label(f"{motor.get('name', '?')} {motor.get('serial_number', '')}").classes("text-3xl font-bold")
    ui.label(say(_STATUS.get(view.status, text("was interrupted")))).classes("text-xl")
    if view.cause:
        ui.label(view.cause).classes("text-base whitespace-pre-line").style("color:#7a130d")
    with ui.row().classes("gap-3 my-3"):
        if session.may_lead and view.status != "completed":
            ui.button(
                say(text("Go on where it ended")), on_click=lambda: _resume(panel, session, run), color=None
            ).classes("mb-go")
        if session.may_lead:
            ui.button(say(text("Measure the next motor")), on_click=lambda: ui.navigate.to("/")).props("outline")
    with ui.element("section").classes("mb-card mb-4"):
        _parameters(run, reader)
    warnings = view.warnings()
    if warnings:
        with ui.element("section").classes("mb-card mb-4"):
            ui.label(say(text("Warnings"))).classes("text-lg font-semibold")
            for procedure, notice in warnings:
                origin = f" ({procedure})" if procedure else ""
                ui.label(f"⚠ {notice.identifier}{origin}: {say(notice.message)}").classes("text-base py-1")


def _parameters(run: LiveRun, reader: Reader) -> None:
    say, view = reader.say, run.view.run
    head = [text("Parameter"), text("Value"), text("Unit"), text("u"), text("u, %"), text("Note's")]
    head += [text("Truth")] if view.truth else []
    lines = []
    for row in rows(view.parameters(), view.truth, reader.translate):
        line = [row.name, row.value, row.unit, row.uncertainty, row.relative, row.note]
        lines.append([*line, *([row.truth] if view.truth else []), row.section])
    if not lines:
        ui.label(say(text("No parameter was measured.")))
        return
    ui.html(
        html_table([*map(say, head), "§"], lines, numeric=frozenset({1, 3, 4, 5, 6} if view.truth else {1, 3, 4, 5})),
        sanitize=False,
    )
    ui.label(say(text("u: standard uncertainty. Note's: the note's simple formula on the same readings."))).classes(
        "text-sm mt-2"
    )


async def _resume(panel: Panel, session: Session, run: LiveRun) -> None:
    try:
        again = await panel.resume(run.name, session.person)
    except InputError as error:
        ui.notify(str(error), type="negative", position="top", timeout=0, close_button=True)
        return
    ui.navigate.to(f"/runs/{again.name}")
