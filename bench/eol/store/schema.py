"""The tables. A motor's test is one row; its figures, checks and waveforms refer to it."""

from typing import Any

from sqlalchemy import (
    Boolean,
    Column,
    DateTime,
    Double,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    false,
)
from sqlalchemy import text as sql

METADATA = MetaData()

#: What did not pass is rare, and asked for often. Queries must say it in these words for the index to serve them.
NOT_PASSED = sql("verdict <> 'pass'")
#: Golden motors' tests are few among many; the same holds.
GOLDEN = sql("golden")

MOTOR = Table(
    "motor",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("identifier", String(36), nullable=False, unique=True),
    Column("batch", String(200), nullable=False),
    Column("number", Integer, nullable=False),
    Column("plan", String(200), nullable=False),
    Column("plan_sha256", String(64), nullable=False),
    Column("station", String(200), nullable=False),
    Column("socket", String(50), nullable=False),
    Column("person", String(200), nullable=False),
    Column("model", String(200), nullable=False),
    Column("serial_number", String(64), nullable=False),
    Column("started", DateTime(timezone=True), nullable=False),
    Column("ended", DateTime(timezone=True), nullable=False),
    Column("verdict", String(10), nullable=False),
    Column("first_pass", Boolean, nullable=False),
    Column("bench_time", Double, nullable=False),
    Column("cause", Text, nullable=False),
    Column("run", Text, nullable=False),
    Column("journal_sha256", String(64), nullable=False),
    Column("diagnosis", Text, nullable=False, server_default=""),
    Column("rework", String(200), nullable=False, server_default=""),
    Column("test_number", Integer, nullable=False, server_default="1"),
    Column("again_by", String(200), nullable=False, server_default=""),
    Column("golden", Boolean, nullable=False, server_default=false()),
    #: What its causes and its diagnosis say, for readers of any language; empty of a motor that passed, and of older records.
    Column("told", Text, nullable=False, server_default=""),
    Index("motor_by_batch", "batch", "model", "verdict", "first_pass", "id"),
    Index("motor_in_batch", "batch", "id"),
    Index("motor_by_serial_number", "serial_number"),
    Index("motor_by_start", "started"),
    Index("motor_golden", "serial_number", sqlite_where=GOLDEN, postgresql_where=GOLDEN),
)

#: Serial numbers under test, each at one station: who inserts the row has it. It goes with the test's record.
SERIAL_CLAIM = Table(
    "serial_claim",
    METADATA,
    Column("serial_number", String(64), primary_key=True),
    Column("identifier", String(36), nullable=False),
    Column("batch", String(200), nullable=False),
    Column("number", Integer, nullable=False),
    Column("station", String(200), nullable=False),
    Column("socket", String(50), nullable=False),
    Column("since", DateTime(timezone=True), nullable=False),
    sqlite_with_rowid=False,
)


def _figure_columns() -> list[Column[Any]]:
    return [
        Column("motor", ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
        Column("parameter", String(100), primary_key=True),
        Column("value", Double),
        Column("unit", String(30), nullable=False),
        Column("standard_uncertainty", Double),
        Column("expanded", Double),
        Column("low", Double),
        Column("high", Double),
        Column("verdict", String(10), nullable=False),
    ]


#: Held together by motor: a record is written in one place. Statistics read the index by value.
FIGURE = Table(
    "figure",
    METADATA,
    *_figure_columns(),
    #: Moments and histograms come from this index alone, one stretch of values after the other.
    Index("figure_by_value", "parameter", "value", "motor"),
    Index(
        "figure_not_passed",
        "parameter",
        "verdict",
        "motor",
        sqlite_where=NOT_PASSED,
        postgresql_where=NOT_PASSED,
    ),
    sqlite_with_rowid=False,
)

#: A station's own file takes figures here first, one motor's beside each other; they go into their table with those of other motors.
FRESH_FIGURE = Table(
    "fresh_figure",
    METADATA,
    *_figure_columns(),
    sqlite_with_rowid=False,
)

#: What readers call the parameters that are not in the table of all: those of plug-ins, which whoever reads may not have.
PARAMETER_LABEL = Table(
    "parameter_label",
    METADATA,
    Column("parameter", String(100), primary_key=True),
    Column("label", Text, nullable=False),
    sqlite_with_rowid=False,
)

CHECK = Table(
    "check_attempt",
    METADATA,
    Column("motor", ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
    Column("procedure", String(100), primary_key=True),
    Column("attempt", Integer, primary_key=True),
    Column("verdict", String(10), nullable=False),
    Column("duration", Double, nullable=False),
    Column("cause", Text, nullable=False),
    Index(
        "check_not_passed",
        "procedure",
        "verdict",
        "motor",
        sqlite_where=NOT_PASSED,
        postgresql_where=NOT_PASSED,
    ),
    sqlite_with_rowid=False,
)

WAVEFORM = Table(
    "waveform",
    METADATA,
    Column("motor", ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
    Column("path", String(500), primary_key=True),
    Column("sha256", String(64), nullable=False),
    sqlite_with_rowid=False,
)

#: Records of a station's own file that its server has not confirmed yet.
OUTBOX = Table(
    "outbox",
    METADATA,
    Column("identifier", String(36), primary_key=True),
    Column("tries", Integer, nullable=False, server_default="0"),
    Column("fault", Text, nullable=False, server_default=""),
)

#: What a batch was measured by: the whole text of its plan and of its motor file.
BATCH_PLAN = Table(
    "batch_plan",
    METADATA,
    Column("batch", String(200), primary_key=True),
    Column("plan_sha256", String(64), primary_key=True),
    Column("motor_sha256", String(64), primary_key=True),
    Column("plan", Text, nullable=False),
    Column("motor", Text, nullable=False),
    sqlite_with_rowid=False,
)

#: The oldest version of a program that may read and write these tables: stations are not brought up to date all at once.
COMPATIBILITY = Table("compatibility", METADATA, Column("least", String(32), primary_key=True))
