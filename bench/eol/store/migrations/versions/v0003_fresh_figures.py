"""The table in which a station's own file takes figures before they go into their table with those of other motors."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Make the table."""
    op.create_table(
        "fresh_figure",
        sa.Column("motor", sa.Integer, sa.ForeignKey("motor.id", ondelete="CASCADE"), primary_key=True),
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
