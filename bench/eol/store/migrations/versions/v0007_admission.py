"""The number of a record among its serial number's tests, golden motors, and serial numbers under test."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Make them."""
    op.add_column("motor", sa.Column("test_number", sa.Integer, nullable=False, server_default="1"))
    op.add_column("motor", sa.Column("again_by", sa.String(200), nullable=False, server_default=""))
    op.add_column("motor", sa.Column("golden", sa.Boolean, nullable=False, server_default=sa.false()))
    golden = sa.text("golden")
    op.create_index("motor_golden", "motor", ["serial_number"], sqlite_where=golden, postgresql_where=golden)
    op.create_table(
        "serial_claim",
        sa.Column("serial_number", sa.String(64), primary_key=True),
        sa.Column("identifier", sa.String(36), nullable=False),
        sa.Column("batch", sa.String(200), nullable=False),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("station", sa.String(200), nullable=False),
        sa.Column("socket", sa.String(50), nullable=False),
        sa.Column("since", sa.DateTime(timezone=True), nullable=False),
        sqlite_with_rowid=False,
    )
