"""Sums of stretches of motors, made as motors end; what removes a motor, of whatever version, forgets them."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"

#: Held by who sums up and by who removes: a sum is never kept of motors that go meanwhile.
_LOCK = 7265194
#: The stretch that holds a motor, if one does.
_HOLDING = (
    "(SELECT first FROM (SELECT first, last FROM summed_stretch WHERE first <= {key} ORDER BY first DESC LIMIT 1) AS near"
    " WHERE last >= {key})"
)
_SUMS = ("summed_motors", "summed_attempts", "summed_figures", "summed_stretch")


def upgrade() -> None:
    """Make the tables, and the triggers on the removal of motors."""
    op.create_table(
        "summed_stretch",
        sa.Column("first", sa.Integer, primary_key=True, autoincrement=False),
        sa.Column("last", sa.Integer, nullable=False),
    )
    op.create_table(
        "summed_motors",
        _first(),
        sa.Column("batch", sa.String(200), primary_key=True),
        sa.Column("model", sa.String(200), primary_key=True),
        sa.Column("verdict", sa.String(10), primary_key=True),
        sa.Column("first_pass", sa.Boolean, primary_key=True),
        sa.Column("count", sa.Integer, nullable=False),
        sa.Column("least", sa.Integer, nullable=False),
        sa.Column("greatest", sa.Integer, nullable=False),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "summed_attempts",
        _first(),
        sa.Column("batch", sa.String(200), primary_key=True),
        sa.Column("model", sa.String(200), primary_key=True),
        sa.Column("procedure", sa.String(100), primary_key=True),
        sa.Column("tests", sa.Integer, nullable=False),
        sa.Column("bad", sa.Integer, nullable=False),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "summed_figures",
        sa.Column("model", sa.String(200), primary_key=True),
        sa.Column("parameter", sa.String(100), primary_key=True),
        _first(),
        sa.Column("low", sa.Double),
        sa.Column("high", sa.Double),
        sa.Column("count", sa.Integer, nullable=False),
        sa.Column("middle", sa.Double, nullable=False),
        sa.Column("total", sa.Double, nullable=False),
        sa.Column("squares", sa.Double, nullable=False),
        sa.Column("edges", sa.Text, nullable=False),
        sa.Column("counts", sa.Text, nullable=False),
        sqlite_with_rowid=False,
    )
    op.create_index("summed_figures_of_stretch", "summed_figures", ["first"])
    op.create_table(
        "repeated_serial",
        sa.Column("serial_number", sa.String(64), primary_key=True),
        sqlite_with_rowid=False,
    )
    if op.get_bind().dialect.name == "sqlite":
        _sqlite_trigger()
    else:
        _postgresql_triggers()


def _first() -> sa.Column[int]:
    return sa.Column("first", sa.Integer, sa.ForeignKey("summed_stretch.first", ondelete="CASCADE"), primary_key=True)


def _sqlite_trigger() -> None:
    # By name, table by table: whoever removes by hand need not have references switched on.
    forget = "".join(f"DELETE FROM {table} WHERE first = {_HOLDING.format(key='OLD.id')};" for table in _SUMS)  # noqa: S608
    old = "DELETE FROM stretch_tally WHERE first > OLD.id - 100000 AND first <= OLD.id;"
    op.execute(f"CREATE TRIGGER motor_removed AFTER DELETE ON motor BEGIN {forget} {old} END")


def _postgresql_triggers() -> None:
    op.execute(
        "CREATE FUNCTION motor_removal_begins() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"
        f" PERFORM pg_advisory_xact_lock({_LOCK}); RETURN NULL; END $$"
    )
    op.execute(
        "CREATE FUNCTION motor_removed() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"  # noqa: S608  our own names
        f" DELETE FROM summed_stretch WHERE first IN (SELECT DISTINCT {_HOLDING.format(key='gone.id')} FROM gone);"
        " DELETE FROM stretch_tally WHERE first IN (SELECT DISTINCT (gone.id - 1) / 100000 * 100000 + 1 FROM gone);"
        " RETURN NULL; END $$"
    )
    op.execute(
        "CREATE TRIGGER motor_removal_begins BEFORE DELETE ON motor"
        " FOR EACH STATEMENT EXECUTE FUNCTION motor_removal_begins()"
    )
    op.execute(
        "CREATE TRIGGER motor_removed AFTER DELETE ON motor REFERENCING OLD TABLE AS gone"
        " FOR EACH STATEMENT EXECUTE FUNCTION motor_removed()"
    )
