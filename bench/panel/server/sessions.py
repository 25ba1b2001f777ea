"""Browsers as the panel knows them: who is logged in, in which language, and for how long."""

import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

#: Sessions that are kept at most; one more ends the one that was not used for the longest time.
_MOST = 1000


class AccessRight(Enum):
    """The rights of a person: watch; lead runs; also change motors and settings and sign results off."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ENGINEER = "engineer"


@dataclass(frozen=True)
class SessionTimes:
    """The longest times (s) that a session lasts without being used, and in all; None for as long as the panel runs."""

    idle: float | None = None
    length: float | None = None


@dataclass
class Session:
    """One browser; `person` is who is logged in, or what was typed as the operator's name.

    `begun` and `used` are times of the clock of its Sessions (s). One that has `ended` may nothing any more.
    """

    token: str
    right: AccessRight
    person: str = ""
    language: str = "en"
    begun: float = 0.0
    used: float = 0.0
    ended: bool = False
    #: Whether a password stands behind it: one can log out.
    logged_in: bool = False

    def call(self, typed: str) -> None:
        """Take the name that was typed; who is logged in acts in the account's name only."""
        if not self.logged_in:
            self.person = typed.strip() or self.person

    @property
    def may_lead(self) -> bool:
        """True if this person may start and lead runs."""
        return not self.ended and self.right is not AccessRight.VIEWER

    @property
    def may_change(self) -> bool:
        """True if this person may change motors and settings, and sign off."""
        return not self.ended and self.right is AccessRight.ENGINEER


class Sessions:
    """Sessions by the token in the browser's cookie; `clock` gives a time (s) that only grows."""

    COOKIE = "motorbench_session"

    def __init__(self, times: SessionTimes | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._times = times or SessionTimes()
        self._clock = clock
        self._sessions: dict[str, Session] = {}
        self._ended: list[Session] = []

    def find(self, token: str | None) -> Session | None:
        """Return the session of a token, if there is one that has not ended."""
        session = self._sessions.get(token or "")
        return session if session is not None and self.lasts(session) else None

    def lasts(self, session: Session) -> bool:
        """Tell whether a session goes on; one whose time is over ends here."""
        times, now = self._times, self._clock()
        idle = times.idle is not None and now - session.used >= times.idle
        if not session.ended and (idle or (times.length is not None and now - session.begun >= times.length)):
            self.end(session.token)
        return not session.ended

    def use(self, session: Session) -> None:
        """Note that somebody does something in a session."""
        session.used = self._clock()

    def open(self, right: AccessRight, person: str = "", language: str = "en", *, logged_in: bool = False) -> Session:
        """Begin a session with a token that nobody can guess."""
        if len(self._sessions) >= _MOST:
            self.end(min(self._sessions.values(), key=lambda session: session.used).token)
        now = self._clock()
        session = Session(secrets.token_urlsafe(32), right, person, language, now, now, logged_in=logged_in)
        self._sessions[session.token] = session
        return session

    def end(self, token: str) -> None:
        """End a session, if there is one of this token."""
        session = self._sessions.pop(token, None)
        if session is not None:
            session.ended = True
            self._ended.append(session)

    def newly_ended(self) -> list[Session]:
        """Return the sessions that have ended since the last call."""
        for session in list(self._sessions.values()):
            self.lasts(session)
        ended, self._ended = self._ended, []
        return ended
