"""Why motors did not pass, for readers of any language. Older records keep it in the language of their batch."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"


def upgrade() -> None:
    """Add the column."""
    op.add_column("motor", sa.Column("told", sa.Text, nullable=False, server_default=""))
