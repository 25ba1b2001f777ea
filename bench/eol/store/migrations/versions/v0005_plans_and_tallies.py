"""The text of each batch's plan, sums of finished stretches of motors, and which older programs may use the tables."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "batch_plan",
        sa.Column("batch", sa.String(200), primary_key=True),
        sa.Column("plan_sha256", sa.String(64), primary_key=True),
        sa.Column("motor_sha256", sa.String(64), primary_key=True),
        sa.Column("plan", sa.Text, nullable=False),
        sa.Column("motor", sa.Text, nullable=False),
        sqlite_with_rowid=False,
    )
    op.create_table(
        "stretch_tally",
        sa.Column("first", sa.Integer, primary_key=True),
        sa.Column("parameter", sa.String(100), primary_key=True),
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
    compatibility = op.create_table("compatibility", sa.Column("least", sa.String(32), primary_key=True))
    op.bulk_insert(compatibility, [{"least": "0005"}])
