"""Indexes that statistics over very many motors read in place of the tables."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Make them."""
    not_passed = sa.text("verdict <> 'pass'")
    op.drop_index("motor_by_batch", "motor")
    op.create_index("motor_by_batch", "motor", ["batch", "model", "verdict", "first_pass", "id"])
    op.create_index("motor_in_batch", "motor", ["batch", "id"])
    op.create_index("figure_by_value", "figure", ["parameter", "value", "motor"])
    op.create_index(
        "figure_not_passed",
        "figure",
        ["parameter", "verdict", "motor"],
        sqlite_where=not_passed,
        postgresql_where=not_passed,
    )
    op.drop_index("check_by_procedure", "check_attempt")
    op.create_index(
        "check_not_passed",
        "check_attempt",
        ["procedure", "verdict", "motor"],
        sqlite_where=not_passed,
        postgresql_where=not_passed,
    )
