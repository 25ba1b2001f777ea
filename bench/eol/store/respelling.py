"""Serial numbers of programs that kept them as they were sent: brought to the one spelling, so that statistics count motors."""

from sqlalchemy import Engine, select

from bench.eol.serial_number import spelled
from bench.eol.store.insertion import spell_alike
from bench.eol.store.repeated_tests import keep_tests_of
from bench.eol.store.schema import MOTOR
from bench.eol.store.summing import lock_sums


def respell(engine: Engine) -> int:
    """Give all records of a database the one spelling of their serial numbers; return how many numbers had another.

    Raises DBAPIError.
    """
    column = MOTOR.c.serial_number
    # Characters of ASCII have one spelling only: numbers of them alone, nearly all, stay where they are.
    other = column.op("GLOB")("*[^ -~]*") if engine.dialect.name == "sqlite" else column.op("~")("[^ -~]")
    with engine.connect() as connection:
        lock_sums(connection)
        sent = [
            each
            for each in connection.execute(select(column).where(other).distinct()).scalars()
            if each != spelled(each)
        ]
        for each in sent:
            spell_alike(connection, spelled(each), [each])
        keep_tests_of(connection, sorted({spelled(each) for each in sent}))
        connection.commit()
    return len(sent)
