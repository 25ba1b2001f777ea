"""The tables. A motor's test is one row; its figures, checks and waveforms refer to it."""

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

#: Held together by motor: a record is written in one place. Statistics read the index by value.
FIGURE = Table(
    "figure",
    METADATA,
    Column("motor", ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
    Column("parameter", String(100), primary_key=True),
    Column("value", Double),
    Column("unit", String(30), nullable=False),
    Column("standard_uncertainty", Double),
    Column("expanded", Double),
    Column("low", Double),
    Column("high", Double),
    Column("verdict", String(10), nullable=False),
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
    Column("motor", ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
    Column("parameter", String(100), primary_key=True),
    Column("value", Double),
    Column("unit", String(30), nullable=False),
    Column("standard_uncertainty", Double),
    Column("expanded", Double),
    Column("low", Double),
    Column("high", Double),
    Column("verdict", String(10), nullable=False),
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

#: Sums by programs before 0008, which alone read and write them; triggers forget them with their motors.
STRETCH_TALLY = Table(
    "stretch_tally",
    METADATA,
    Column("first", Integer, primary_key=True),
    Column("parameter", String(100), primary_key=True),
    Column("low", Double),
    Column("high", Double),
    Column("count", Integer, nullable=False),
    Column("middle", Double, nullable=False),
    Column("total", Double, nullable=False),
    Column("squares", Double, nullable=False),
    Column("edges", Text, nullable=False),
    Column("counts", Text, nullable=False),
    sqlite_with_rowid=False,
)

#: Stretches of keys (`first` … `last`) whose motors are summed up, in the tables that follow. A trigger forgets a stretch with
#: the first of its motors that is removed, by whatever program. Programs before 0009 do not sum up by occasion; those after sum
#: theirs up anew.
SUMMED_STRETCH = Table(
    "summed_stretch",
    METADATA,
    Column("first", Integer, primary_key=True, autoincrement=False),
    Column("last", Integer, nullable=False),
    Column("by_occasion", Boolean, nullable=False, server_default=false()),
)

#: A stretch's tests of motors by what they have in common, with the least and the greatest of their keys.
SUMMED_MOTORS = Table(
    "summed_motors",
    METADATA,
    Column("first", ForeignKey("summed_stretch.first", ondelete="CASCADE"), primary_key=True),
    Column("batch", String(200), primary_key=True),
    Column("model", String(200), primary_key=True),
    Column("verdict", String(10), primary_key=True),
    Column("first_pass", Boolean, primary_key=True),
    Column("count", Integer, nullable=False),
    Column("least", Integer, nullable=False),
    Column("greatest", Integer, nullable=False),
    sqlite_with_rowid=False,
)

#: A stretch's judged tests by where and by which plan they were made.
SUMMED_PLACES = Table(
    "summed_places",
    METADATA,
    Column("first", ForeignKey("summed_stretch.first", ondelete="CASCADE"), primary_key=True),
    Column("batch", String(200), primary_key=True),
    Column("model", String(200), primary_key=True),
    Column("plan", String(200), primary_key=True),
    Column("station", String(200), primary_key=True),
    Column("socket", String(50), primary_key=True),
    Column("verdict", String(10), primary_key=True),
    Column("first_pass", Boolean, primary_key=True),
    Column("count", Integer, nullable=False),
    sqlite_with_rowid=False,
)

#: A stretch's judged tests by when they began: `step` counts five minutes since 1970 (UTC).
SUMMED_TIMES = Table(
    "summed_times",
    METADATA,
    Column("first", ForeignKey("summed_stretch.first", ondelete="CASCADE"), primary_key=True),
    Column("batch", String(200), primary_key=True),
    Column("model", String(200), primary_key=True),
    Column("step", Integer, primary_key=True),
    Column("verdict", String(10), primary_key=True),
    Column("first_pass", Boolean, primary_key=True),
    Column("count", Integer, nullable=False),
    sqlite_with_rowid=False,
)

#: First attempts at a procedure in judged tests, and how many of them did not pass.
SUMMED_ATTEMPTS = Table(
    "summed_attempts",
    METADATA,
    Column("first", ForeignKey("summed_stretch.first", ondelete="CASCADE"), primary_key=True),
    Column("batch", String(200), primary_key=True),
    Column("model", String(200), primary_key=True),
    Column("procedure", String(100), primary_key=True),
    Column("tests", Integer, nullable=False),
    Column("bad", Integer, nullable=False),
    sqlite_with_rowid=False,
)

#: What a type's figures of a parameter sum up to. `edges` and `counts` are lists in JSON, as a histogram's. A count of -1: the
#: limits changed within the stretch, and its figures have to be read.
SUMMED_FIGURES = Table(
    "summed_figures",
    METADATA,
    Column("model", String(200), primary_key=True),
    Column("parameter", String(100), primary_key=True),
    Column("first", ForeignKey("summed_stretch.first", ondelete="CASCADE"), primary_key=True),
    Column("low", Double),
    Column("high", Double),
    Column("count", Integer, nullable=False),
    Column("middle", Double, nullable=False),
    Column("total", Double, nullable=False),
    Column("squares", Double, nullable=False),
    Column("edges", Text, nullable=False),
    Column("counts", Text, nullable=False),
    Index("summed_figures_of_stretch", "first"),
    sqlite_with_rowid=False,
)

#: Serial numbers that a summed-up test shares with another test: those tested more than once are these and some not summed up.
REPEATED_SERIAL = Table(
    "repeated_serial",
    METADATA,
    Column("serial_number", String(64), primary_key=True),
    sqlite_with_rowid=False,
)

#: The oldest version of a program that may read and write these tables: stations are not brought up to date all at once.
COMPATIBILITY = Table("compatibility", METADATA, Column("least", String(32), primary_key=True))
