"""Judged tests of motors that have several, kept beside each other, so that statistics need not look for them one by one."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"

_HOLDING = (
    "(SELECT first FROM (SELECT first, last FROM summed_stretch WHERE first <= {key} ORDER BY first DESC LIMIT 1) AS near"
    " WHERE last >= {key})"
)
_SUMS = ("summed_motors", "summed_places", "summed_times", "summed_attempts", "summed_figures", "summed_stretch")


def upgrade() -> None:
    """Make the table, and have the triggers on a motor's removal say that those left of its serial number are to be counted anew."""
    op.add_column("summed_stretch", sa.Column("by_test", sa.Boolean, nullable=False, server_default=sa.false()))
    op.create_table(
        "repeated_test",
        sa.Column("motor", sa.Integer, sa.ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
        sa.Column("serial_number", sa.String(64), nullable=False),
        sa.Column("started", sa.DateTime(timezone=True), nullable=False),
        sa.Column("step", sa.Integer, nullable=False),
        sa.Column("batch", sa.String(200), nullable=False),
        sa.Column("model", sa.String(200), nullable=False),
        sa.Column("plan", sa.String(200), nullable=False),
        sa.Column("station", sa.String(200), nullable=False),
        sa.Column("socket", sa.String(50), nullable=False),
        sa.Column("passed", sa.Boolean, nullable=False),
        sa.Column("at_once", sa.Boolean, nullable=False),
        sa.Column("attempts", sa.Text, nullable=False),
        sa.Column("place", sa.Integer, nullable=False),
        sa.Column("tests", sa.Integer, nullable=False),
        sa.Column("last_passed", sa.Boolean, nullable=False),
    )
    op.create_index("repeated_test_by_serial_number", "repeated_test", ["serial_number"])
    if op.get_bind().dialect.name == "sqlite":
        # By name, table by table: whoever removes by hand need not have references switched on.
        forget = "".join(f"DELETE FROM {table} WHERE first = {_HOLDING.format(key='OLD.id')};" for table in _SUMS)  # noqa: S608
        old = "DELETE FROM stretch_tally WHERE first > OLD.id - 100000 AND first <= OLD.id;"
        test = "DELETE FROM repeated_test WHERE motor = OLD.id;"
        others = "UPDATE repeated_test SET place = 0 WHERE serial_number = OLD.serial_number;"
        op.execute("DROP TRIGGER motor_removed")
        op.execute(f"CREATE TRIGGER motor_removed AFTER DELETE ON motor BEGIN {forget} {old} {test} {others} END")
        return
    op.execute(
        "CREATE OR REPLACE FUNCTION motor_removed() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"  # noqa: S608  our own names
        f" DELETE FROM summed_stretch WHERE first IN (SELECT DISTINCT {_HOLDING.format(key='gone.id')} FROM gone);"
        " DELETE FROM stretch_tally WHERE first IN (SELECT DISTINCT (gone.id - 1) / 100000 * 100000 + 1 FROM gone);"
        " UPDATE repeated_test SET place = 0 WHERE serial_number IN (SELECT serial_number FROM gone);"
        " RETURN NULL; END $$"
    )
