"""The tables of what is summed up as motors end; what they sum up stays in its own."""

from sqlalchemy import Boolean, Column, DateTime, Double, ForeignKey, Index, Integer, String, Table, Text, false

from bench.eol.store.schema import METADATA

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
#: the first of its motors that is removed, by whatever program. Programs before 0009 do not sum up by occasion, and
#: those before 0010 keep no repeated tests; those after do it for them.
SUMMED_STRETCH = Table(
    "summed_stretch",
    METADATA,
    Column("first", Integer, primary_key=True, autoincrement=False),
    Column("last", Integer, nullable=False),
    Column("by_occasion", Boolean, nullable=False, server_default=false()),
    Column("by_test", Boolean, nullable=False, server_default=false()),
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

#: Serial numbers that a summed-up test shares with another test; programs before 0010 read them.
REPEATED_SERIAL = Table(
    "repeated_serial",
    METADATA,
    Column("serial_number", String(64), primary_key=True),
    sqlite_with_rowid=False,
)

#: Judged tests of serial numbers that a summed-up test shares with another test, with all that yields ask of them. `step` is that
#: of the times above; `attempts` is a list in JSON: [procedure, 1 where its first attempt did not pass], in order.
#: `place` is the test's among the judged `tests` of its serial number, and `last_passed` whether the last of them did; a trigger sets it
#: to 0 where another of them is removed, and these have to be counted anew.
REPEATED_TEST = Table(
    "repeated_test",
    METADATA,
    Column("motor", ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
    Column("serial_number", String(64), nullable=False),
    Column("started", DateTime(timezone=True), nullable=False),
    Column("step", Integer, nullable=False),
    Column("batch", String(200), nullable=False),
    Column("model", String(200), nullable=False),
    Column("plan", String(200), nullable=False),
    Column("station", String(200), nullable=False),
    Column("socket", String(50), nullable=False),
    Column("passed", Boolean, nullable=False),
    Column("at_once", Boolean, nullable=False),
    Column("attempts", Text, nullable=False),
    Column("place", Integer, nullable=False),
    Column("tests", Integer, nullable=False),
    Column("last_passed", Boolean, nullable=False),
    Index("repeated_test_by_serial_number", "serial_number"),
)
