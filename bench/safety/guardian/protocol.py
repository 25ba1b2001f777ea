"""Start data of a guardian, and the messages between the two processes afterwards.

Both ways one JSON object a line. The run says `beat` (with a number, and for how long it has not got on), `on` (the
roles that are energised from here on), `ending` and `ended` (an energised block of this role after an error),
`handled` (the run goes on after an error), `stop` (somebody requested it), `unanswered` (an energised source, the
`role`, does not answer the run), `awake` (it has heard that the shutdown was carried out), `down` (it carries out the shutdown
itself) and `done` (with `unsafe` where something could not be switched off); the guardian says `ready`, `echo`,
`took`, `walked` (what its own shutdown could not do), `yours` (it leaves the instruments to a run that is awake) and
`alarm`.
"""

import json
from dataclasses import asdict, dataclass
from typing import Any

#: Beats sent within the time after which the guardian takes the run for dead.
BEATS = 6


@dataclass(frozen=True)
class GuardianTask:
    """The station (its file's name and content), the roles to guard, the run's folder, and how long (s) the run may be
    silent (`heartbeat`) or not get on (`stalled`). `token` is in the run's record and in the guardian's own.
    """

    source: str
    content: str
    roles: tuple[str, ...]
    folder: str
    heartbeat: float
    stalled: float
    token: str = ""

    def line(self) -> bytes:
        """Return it as the first line that the guardian reads."""
        return encode(asdict(self))


def charge_of(message: dict[str, Any]) -> GuardianTask:
    """Return the charge that a line holds. Raises TypeError where it holds none."""
    return GuardianTask(**{**message, "roles": tuple(message["roles"])})


def encode(message: dict[str, Any]) -> bytes:
    """Return a message as a line."""
    return json.dumps(message, ensure_ascii=False).encode() + b"\n"


def decode(line: bytes) -> dict[str, Any]:
    """Return the message of a line. Raises ValueError where it is none."""
    message = json.loads(line)
    if not isinstance(message, dict):
        raise ValueError(f"{line[:60]!r} is no message")  # noqa: TRY004  a value of JSON, not of the program
    return message
