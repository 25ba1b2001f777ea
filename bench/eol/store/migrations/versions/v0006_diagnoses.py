"""The parts at fault of motors that failed, and their rework codes."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Add the columns; of motors that were measured before, nothing is known."""
    op.add_column("motor", sa.Column("diagnosis", sa.Text, nullable=False, server_default=""))
    op.add_column("motor", sa.Column("rework", sa.String(200), nullable=False, server_default=""))
