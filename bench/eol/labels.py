"""The line that is printed and stuck on a motor."""

from bench.eol.record import MotorRecord


def label_of(record: MotorRecord) -> str:
    """Return a motor's label: serial number, type, verdict, when (UTC), plan, socket, and the record's first eight digits.

    One that failed has the rework codes of the parts at fault in the end.
    """
    return " | ".join(
        (
            record.serial_number,
            record.model,
            record.verdict.value.upper(),
            record.ended.strftime("%Y-%m-%d %H:%M"),
            record.plan,
            f"socket {record.socket}",
            record.identifier[:8],
            *((record.rework,) if record.rework else ()),
        )
    )
