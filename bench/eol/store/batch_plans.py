"""The plans of batches: the whole text of each plan and its motor file, kept with the records."""

from dataclasses import asdict, dataclass

from sqlalchemy import Connection, Engine, delete, select
from sqlalchemy.dialects import postgresql, sqlite

from bench.eol.store.schema import BATCH_PLAN


@dataclass(frozen=True)
class BatchPlan:
    """A batch's plan and motor file as they were read, each with the SHA-256 that the records name."""

    batch: str
    plan_sha256: str
    motor_sha256: str
    plan: str
    motor: str


def keep_plan(connection: Connection, plan: BatchPlan) -> None:
    """Keep a batch's plan; one that is there already stays."""
    own = (postgresql if connection.dialect.name == "postgresql" else sqlite).insert(BATCH_PLAN)
    connection.execute(own.values(**asdict(plan)).on_conflict_do_nothing())


def plans_of(connection: Connection, batch: str) -> list[BatchPlan]:
    """Return what a batch was measured by; none for one that was measured before plans were kept."""
    query = select(BATCH_PLAN).where(BATCH_PLAN.c.batch == batch)
    return [BatchPlan(**row) for row in connection.execute(query).mappings()]


def carry_plans(own: Engine, server: Engine, batch: str) -> None:
    """Copy the plans of a batch's records from a station's own file to a server."""
    with own.connect() as connection:
        plans = plans_of(connection, batch)
    with server.begin() as connection:
        for plan in plans:
            keep_plan(connection, plan)


def forget_plans(connection: Connection, batch: str) -> None:
    """Remove what is kept of a batch's plan."""
    connection.execute(delete(BATCH_PLAN).where(BATCH_PLAN.c.batch == batch))
