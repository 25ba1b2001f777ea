"""The identity part of a report: the motor, the bench, its instruments and their calibrations, the operator, the record."""

from drivers.interfaces.text import Text, lines, text, word
from procedures.core.nameplate import WindingConnection
from reports.document.model import (
    Block,
    Cell,
    Column,
    Facts,
    Notices,
    Paragraph,
    ReportSection,
    Signatures,
    Table,
    TableRow,
)
from reports.document.record import InstrumentRecord, RunRecord, SignOff
from reports.labels import role_name

_CONNECTIONS = {WindingConnection.WYE: text("wye"), WindingConnection.DELTA: text("delta")}
_PERFORMED: dict[str, Text] = {
    "": text("as the station has it"),
    "terminal": text("a person at the terminal"),
    "panel": text("a person at the panel"),
    "answers": text("readings from a file"),
    "virtual": text("the virtual operator"),
    "fixture": text("the fixture"),
}


def motor_section(run: RunRecord) -> ReportSection:
    """Return the motor's plate."""
    plate = run.nameplate
    items: list[tuple[Text, Cell]] = [
        (text("Motor"), plate.name),
        (text("Serial number"), plate.serial_number or "–"),
        (text("Winding"), _CONNECTIONS[plate.connection]),
        (text("Rated current, phase, peak"), f"{plate.rated_current:g} A"),
    ]
    for name, value, unit in (
        (text("Maximum current, phase, peak"), plate.maximum_current, "A"),
        (text("Rated voltage"), plate.rated_voltage, "V"),
        (text("Rated speed"), plate.rated_speed_rpm, "rpm"),
        (text("Maximum speed"), plate.maximum_speed_rpm, "rpm"),
        (text("Maximum winding temperature"), plate.maximum_winding_temperature, "°C"),
        (text("Insulation test voltage (DC)"), plate.insulation_test_voltage, "V"),
        (text("Pole pairs, data sheet"), plate.pole_pairs, ""),
    ):
        if value is not None:
            items.append((name, f"{value:g} {unit}".strip()))
    if plate.wire_colours:
        items.append(
            (
                text("Wires"),
                lines(
                    (text("{terminal}: {colour}", terminal=t, colour=word(c)) for t, c in plate.wire_colours.items()),
                    "; ",
                ),
            )
        )
    items.append((text("Motor file"), f"{run.motor_file}, SHA-256 {run.motor_sha256[:16]}…"))
    return ReportSection(text("Motor"), "motor", (Facts(items),))


def station_section(run: RunRecord) -> ReportSection:
    """Return station, operator and instruments; an overdue calibration is flagged."""
    facts = Facts(
        (
            (text("Station"), run.station),
            (text("Station file"), f"{run.station_file}, SHA-256 {run.station_sha256[:16]}…"),
            (text("Operator"), run.operator or "–"),
            (text("Hand work by"), _PERFORMED.get(run.performed_by, run.performed_by)),
            (text("Begun at"), run.started),
            (text("Ended at"), run.ended),
            (text("Software"), ", ".join(f"{name} {version}" for name, version in run.software.items())),
        )
    )
    overdue = [i for i in run.instruments if i.used and i.calibration is not None and i.calibration.overdue]
    blocks: list[Block] = [facts, instrument_table(run)]
    if overdue:
        flagged = text(
            "The calibration of {roles} was overdue on the day of the measurement; the stated accuracy is not "
            "confirmed.",
            roles=[role_name(instrument.role) for instrument in overdue],
        )
        blocks.append(Notices((("calibration-overdue", flagged),), grave=True))
    return ReportSection(text("Bench"), "bench", tuple(blocks))


def instrument_table(run: RunRecord) -> Table:
    """Return the station's instruments with what they said of themselves and their calibrations."""
    unused = text("Instruments in grey took no part in this run.")
    return Table(
        [
            Column(text("Instrument")),
            Column(text("Identity"), wide=True),
            Column(text("Driver and address"), wide=True),
            Column(text("Certificate")),
            Column(text("Calibrated")),
            Column(text("Due")),
        ],
        [TableRow(_instrument(instrument), faint=not instrument.used) for instrument in run.instruments],
        remark=None if all(instrument.used for instrument in run.instruments) else unused,
    )


def _instrument(instrument: InstrumentRecord) -> list[Cell]:
    calibration = instrument.calibration
    cells: list[Cell] = [
        role_name(instrument.role),
        instrument.identity or "–",
        f"{instrument.driver}, {instrument.address}".rstrip(", "),
    ]
    if calibration is None:
        return [*cells, text("none entered"), "–", "–"]
    due: Cell = text("{due}, overdue", due=calibration.due) if calibration.overdue else calibration.due
    return [*cells, calibration.certificate, calibration.date, due]


def record_section(run: RunRecord) -> ReportSection:
    """Return where the record ends, and how anyone can prove that it is the one this report is of."""
    blocks: list[Block] = [
        Facts(
            (
                (text("Run"), run.name),
                (text("Events in the journal"), str(run.journal.events)),
                (text("SHA-256 of the last event"), run.journal.sha256),
            )
        ),
        Paragraph(
            text(
                "Each event of the journal holds the hash of the one before. This command proves that the journal, the waveforms and the "
                "result are those that this report was made from:"
            ),
            small=True,
        ),
        Paragraph(f"motorbench results verify {run.name} --sha256 {run.journal.sha256}", code=True),
    ]
    if run.journal.torn:
        blocks.append(
            Notices((("", text("The last line of the journal is incomplete; it is not part of this report.")),))
        )
    return ReportSection(text("Record"), "record", tuple(blocks))


#: What who signed may do, and where there are no accounts.
_ROLES = {str(role): role for role in (text("operator"), text("engineer"), text("at a terminal"))}


def signature_section(run: RunRecord) -> ReportSection:
    """Return who has signed already, and the lines to sign on."""
    lines = Signatures((text("Measured by, date"), text("Checked by, date"), text("Approved by, date")))
    blocks: tuple[Block, ...] = (lines,)
    if run.signed:
        columns = [
            Column(text("Name")),
            Column(text("Role")),
            Column(text("Date")),
            Column(text("Meaning"), wide=True),
            Column(text("Remark"), wide=True),
            Column(text("Concerns"), wide=True),
        ]
        rows = [
            TableRow(
                [one.person, _ROLES.get(one.role, one.role), one.time, one.meaning, one.words or "–", _concerns(one)]
            )
            for one in run.signed
        ]
        blocks = (Table(columns, rows, title=text("Signed electronically")), lines)
    return ReportSection(text("Signatures"), "signatures", blocks)


def _concerns(signature: SignOff) -> Text:
    if signature.holds:
        return text("the run as it stands here")
    return text("an earlier state: the run was continued, or changed, after it")
