"""Browsers as the panel knows them: who is logged in, in which language."""

import secrets
from dataclasses import dataclass
from enum import Enum


class Right(Enum):
    """What a person may do: watch; lead runs; also change motors and settings and sign results off."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ENGINEER = "engineer"


@dataclass
class Session:
    """One browser; `person` is who is logged in, or what was typed as the operator's name."""

    token: str
    right: Right
    person: str = ""
    language: str = "en"

    @property
    def may_lead(self) -> bool:
        """Whether this person may start and lead runs."""
        return self.right is not Right.VIEWER

    @property
    def may_change(self) -> bool:
        """Whether this person may change motors and settings, and sign off."""
        return self.right is Right.ENGINEER


class Sessions:
    """Sessions by the token in the browser's cookie."""

    COOKIE = "motorbench_session"

    def __init__(self) -> None:
        self._sessions: dict[str, Session] = {}

    def find(self, token: str | None) -> Session | None:
        """Return the session of a token, if there is one."""
        return self._sessions.get(token or "")

    def open(self, right: Right, person: str = "", language: str = "en") -> Session:
        """Begin a session with a token that nobody can guess."""
        session = Session(secrets.token_urlsafe(32), right, person, language)
        self._sessions[session.token] = session
        return session

    def end(self, token: str) -> None:
        """Forget a session."""
        self._sessions.pop(token, None)
