"""Judged tests summed up by place and by time. Stretches that were summed up before are summed up anew, by whoever does so next."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"

_HOLDING = (
    "(SELECT first FROM (SELECT first, last FROM summed_stretch WHERE first <= OLD.id ORDER BY first DESC LIMIT 1) AS near"
    " WHERE last >= OLD.id)"
)
_SUMS = ("summed_motors", "summed_places", "summed_times", "summed_attempts", "summed_figures", "summed_stretch")


def upgrade() -> None:
    """Make the tables, and have a file's trigger forget them too; on a server they go with their stretch."""
    op.add_column("summed_stretch", sa.Column("by_occasion", sa.Boolean, nullable=False, server_default=sa.false()))
    _table(
        "summed_places",
        sa.Column("plan", sa.String(200), primary_key=True),
        sa.Column("station", sa.String(200), primary_key=True),
        sa.Column("socket", sa.String(50), primary_key=True),
    )
    _table("summed_times", sa.Column("step", sa.Integer, primary_key=True))
    if op.get_bind().dialect.name == "sqlite":
        # By name, table by table: whoever removes by hand need not have references switched on.
        forget = "".join(f"DELETE FROM {table} WHERE first = {_HOLDING};" for table in _SUMS)  # noqa: S608  our own names
        old = "DELETE FROM stretch_tally WHERE first > OLD.id - 100000 AND first <= OLD.id;"
        op.execute("DROP TRIGGER motor_removed")
        op.execute(f"CREATE TRIGGER motor_removed AFTER DELETE ON motor BEGIN {forget} {old} END")


def _table(name: str, *told_apart: sa.Column[object]) -> None:
    op.create_table(
        name,
        sa.Column("first", sa.Integer, sa.ForeignKey("summed_stretch.first", ondelete="CASCADE"), primary_key=True),
        sa.Column("batch", sa.String(200), primary_key=True),
        sa.Column("model", sa.String(200), primary_key=True),
        *told_apart,
        sa.Column("verdict", sa.String(10), primary_key=True),
        sa.Column("first_pass", sa.Boolean, primary_key=True),
        sa.Column("count", sa.Integer, nullable=False),
        sqlite_with_rowid=False,
    )
