"""Judged tests of motors that have several, kept beside each other, so that statistics need not look for them one by one."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"

_HOLDING = (
    "(SELECT first FROM (SELECT first, last FROM summed_stretch WHERE first <= OLD.id ORDER BY first DESC LIMIT 1) AS near"
    " WHERE last >= OLD.id)"
)
_SUMS = ("summed_motors", "summed_places", "summed_times", "summed_attempts", "summed_figures", "summed_stretch")


def upgrade() -> None:
    """Make the table, and have a file's trigger forget a removed motor's test; on a server it goes by its reference."""
    op.add_column("summed_stretch", sa.Column("by_test", sa.Boolean, nullable=False, server_default=sa.false()))
    op.create_table(
        "repeated_test",
        sa.Column("motor", sa.Integer, sa.ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
        sa.Column(
            "serial_number", sa.String(64).with_variant(sa.String(64, collation="C"), "postgresql"), nullable=False
        ),
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
    )
    if op.get_bind().dialect.name == "sqlite":
        # By name, table by table: whoever removes by hand need not have references switched on.
        forget = "".join(f"DELETE FROM {table} WHERE first = {_HOLDING};" for table in _SUMS)  # noqa: S608  our own names
        old = "DELETE FROM stretch_tally WHERE first > OLD.id - 100000 AND first <= OLD.id;"
        test = "DELETE FROM repeated_test WHERE motor = OLD.id;"
        op.execute("DROP TRIGGER motor_removed")
        op.execute(f"CREATE TRIGGER motor_removed AFTER DELETE ON motor BEGIN {forget} {old} {test} END")
