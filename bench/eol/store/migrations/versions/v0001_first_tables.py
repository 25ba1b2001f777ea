"""The first tables."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def _motor_key() -> "sa.Column[int]":
    return sa.Column("motor", sa.Integer, sa.ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True)


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "motor",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("identifier", sa.String(36), nullable=False, unique=True),
        sa.Column("batch", sa.String(200), nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("plan", sa.String(200), nullable=False),
        sa.Column("plan_sha256", sa.String(64), nullable=False),
        sa.Column("station", sa.String(200), nullable=False),
        sa.Column("socket", sa.String(50), nullable=False),
        sa.Column("person", sa.String(200), nullable=False),
        sa.Column("model", sa.String(200), nullable=False),
        sa.Column("serial_number", sa.String(64), nullable=False),
        sa.Column("started", sa.DateTime(timezone=True), nullable=False),
        sa.Column("ended", sa.DateTime(timezone=True), nullable=False),
        sa.Column("verdict", sa.String(10), nullable=False),
        sa.Column("first_pass", sa.Boolean, nullable=False),
        sa.Column("bench_time", sa.Double, nullable=False),
        sa.Column("cause", sa.Text, nullable=False),
        sa.Column("run", sa.Text, nullable=False),
        sa.Column("journal_sha256", sa.String(64), nullable=False),
    )
    op.create_index("motor_by_batch", "motor", ["batch", "verdict", "first_pass"])
    op.create_index("motor_by_serial_number", "motor", ["serial_number"])
    op.create_index("motor_by_start", "motor", ["started"])
    op.create_table(
        "figure",
        _motor_key(),
        sa.Column("parameter", sa.String(100), primary_key=True),
        sa.Column("value", sa.Double),
        sa.Column("unit", sa.String(30), nullable=False),
        sa.Column("standard_uncertainty", sa.Double),
        sa.Column("expanded", sa.Double),
        sa.Column("low", sa.Double),
        sa.Column("high", sa.Double),
        sa.Column("verdict", sa.String(10), nullable=False),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "check_attempt",
        _motor_key(),
        sa.Column("procedure", sa.String(100), primary_key=True),
        sa.Column("attempt", sa.Integer, primary_key=True),
        sa.Column("verdict", sa.String(10), nullable=False),
        sa.Column("duration", sa.Double, nullable=False),
        sa.Column("cause", sa.Text, nullable=False),
        sqlite_with_rowid=False,
    )
    op.create_index("check_by_procedure", "check_attempt", ["procedure", "verdict"])
    op.create_table(
        "waveform",
        _motor_key(),
        sa.Column("path", sa.String(500), primary_key=True),
        sa.Column("sha256", sa.String(64), nullable=False),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "outbox",
        sa.Column("identifier", sa.String(36), primary_key=True),
        sa.Column("tries", sa.Integer, nullable=False, server_default="0"),
        sa.Column("fault", sa.Text, nullable=False, server_default=""),
    )
