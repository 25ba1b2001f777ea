"""A run as a document: what was found, who and what, each procedure, the record."""

from drivers.interfaces.text import Text, text, word
from reports.document.identity import motor_section, record_section, signature_section, station_section
from reports.document.model import (
    Block,
    Column,
    Document,
    Drawings,
    Facts,
    Notices,
    Paragraph,
    ReportSection,
    Table,
    TableRow,
)
from reports.document.parameters import parameter_table, withheld_notices
from reports.document.procedure import procedure_section
from reports.document.record import RunRecord
from reports.tables.summary import other_warnings

_STATUS: dict[str, Text] = {
    "completed": text("completed"),
    "failed": text("failed"),
    "aborted": text("was aborted"),
    "interrupted": text("was interrupted"),
}


def compose(run: RunRecord) -> Document:
    """Return the report of a run, whole or cut off."""
    plate = run.nameplate
    motor = plate.name + (f", {plate.serial_number}" if plate.serial_number else "")
    return Document(
        title=text("Motor parameter report"),
        subtitle=motor,
        origin=f"{run.started} · {run.name}",
        running=f"{motor} · {run.name} · {run.journal.sha256[:16]}",
        sections=(
            _summary(run),
            motor_section(run),
            station_section(run),
            *([_photos(run)] if run.photos else []),
            _plan(run),
            *(procedure_section(procedure, run.nameplate.wire_colours) for procedure in run.procedures),
            signature_section(run),
            record_section(run),
        ),
    )


def _summary(run: RunRecord) -> ReportSection:
    blocks: list[Block] = []
    if run.status != "completed":
        message = text(
            "The run {status}: {cause}", status=_STATUS.get(run.status, text("was interrupted")), cause=run.cause or "–"
        )
        blocks.append(Notices((("", message),), grave=True))
    together = [(notice.identifier, notice.message) for procedure, notice in run.warnings if not procedure]
    if together:
        blocks.append(Notices(together, grave=True))
    if run.parameters.parameters or run.parameters.withheld:
        blocks.append(parameter_table(run.parameters, run.truth))
    else:
        blocks.append(Paragraph(text("No parameter was measured.")))
    if run.parameters.withheld:
        blocks.append(withheld_notices(reason for reasons in run.parameters.withheld.values() for reason in reasons))
    warnings = other_warnings(run.parameters, run.warnings)
    titles = {procedure.name: procedure.title for procedure in run.procedures}
    own = [(notice.identifier, titles.get(name, word(name)), notice.message) for name, notice in warnings if name]
    if own:
        blocks.append(
            Table(
                [Column(text("Id")), Column(text("Procedure")), Column(text("Warning or erratum"), wide=True)],
                [TableRow([word(identifier), title, words]) for identifier, title, words in own],
                title=text("Warnings and errata"),
            )
        )
    return ReportSection(text("Results"), "results", tuple(blocks))


def _photos(run: RunRecord) -> ReportSection:
    """Return what the motor and the bench look like; the motor's file or the station's named the photos."""
    drawings = Drawings([(draw, words) for words, draw in run.photos])
    return ReportSection(text("Photos"), "photos", (drawings,))


def _plan(run: RunRecord) -> ReportSection:
    """Return the procedures as they followed each other, each with its end."""
    rows = []
    for procedure in run.procedures:
        ended = (
            text("failed")
            if procedure.cause
            else (text("done") if procedure.result is not None else text("not finished"))
        )
        given = procedure.result.parameters if procedure.result is not None else ()
        gave = Text("{names}", {"names": list({each.name: each.label for each in given}.values())})
        rows.append(TableRow([procedure.section, procedure.title, procedure.name, gave, ended]))
    table = Table(
        [
            Column("§"),
            Column(text("Procedure"), wide=True),
            Column(text("Short name")),
            Column(text("Gives"), wide=True),
            Column(text("Outcome")),
        ],
        rows,
    )
    facts = Facts(((text("Bench time"), f"{run.bench_time:.0f} s"),))
    return ReportSection(text("Procedures"), "procedures", (facts, table))
