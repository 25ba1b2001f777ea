"""Whose messages a page takes: those of the session that it was made for, as long as that lasts."""

import asyncio
import inspect
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import parse_qs

from nicegui import Client
from socketio import AsyncServer
from socketio.exceptions import ConnectionRefusedError as HandshakeRefusedError

from bench.panel.live.control import Control
from bench.panel.pages.ended_session import abort_of, show_ended
from bench.panel.server.sessions import Session, Sessions

#: How often (s) sessions are looked at.
_LOOK = 1.0


class SocketGuard:
    """Stands before NiceGUI's handlers of a page's messages.

    A page is found by an identifier that its messages name themselves: here they must come over a connection of the
    page's own session. When a session ends, its pages lose all they had but the abort.
    """

    def __init__(self, server: AsyncServer, sessions: Sessions, control: Control) -> None:
        self._server = server
        self._sessions = sessions
        self._control = control
        self._task: asyncio.Task[None] | None = None

    def install(self) -> None:
        """Put itself before the handlers that are there."""
        # Pages come from the panel's own origin alone, which the gate has seen to: no other is told that it may.
        self._server.eio.cors_allowed_origins = []
        handlers: Mapping[str, Callable[..., Any]] = self._server.handlers["/"]
        self._server.on("connect", self._connecting(handlers["connect"]))
        self._server.on("handshake", self._guarded(handlers["handshake"], self._may_speak))
        self._server.on("event", self._guarded(handlers["event"], self._may_act))
        for name in ("javascript_response", "ack", "log"):
            self._server.on(name, self._guarded(handlers[name], self._may_speak))

    async def open(self) -> None:
        """Begin to look after sessions that end."""
        self._task = asyncio.create_task(self._look())

    async def close(self) -> None:
        """Stop looking."""
        if self._task is not None:
            self._task.cancel()

    def end_sessions(self) -> None:
        """Take their rights from the pages of sessions that have ended."""
        ended = {session.token: session for session in self._sessions.newly_ended()}
        if not ended:
            return
        for token in ended:
            self._control.release(token)
        for client in list(Client.instances.values()):
            session = _session_of(client)
            if session is not None and session.token in ended:
                show_ended(client, session)

    async def _look(self) -> None:
        while True:
            await asyncio.sleep(_LOOK)
            self.end_sessions()

    def _connecting(self, handler: Callable[..., Any]) -> Callable[..., Any]:
        async def connect(sid: str, environ: dict[str, Any], *more: Any) -> Any:
            named = parse_qs(environ.get("QUERY_STRING", "")).get("client_id", [""])[0]
            client = Client.instances.get(named)
            # One that has gone is NiceGUI's to answer: the browser then loads the page anew.
            if client is not None and _session_of(client) is not _session_in(environ):
                raise HandshakeRefusedError("not a page of this session")
            return await handler(sid, environ, *more)

        return connect

    def _guarded(self, handler: Callable[..., Any], allowed: Callable[[str, Any], bool]) -> Callable[..., Any]:
        async def guarded(sid: str, message: Any) -> Any:
            if not allowed(sid, message):
                return False
            answer = handler(sid, message)
            return await answer if inspect.isawaitable(answer) else answer

        return guarded

    def _may_speak(self, sid: str, message: Any) -> bool:
        return self._client(sid, message) is not None

    def _may_act(self, sid: str, message: Any) -> bool:
        client = self._client(sid, message)
        session = _session_of(client) if client is not None else None
        if client is None or session is None:
            return False
        abort = abort_of(client)
        if abort is not None and message.get("id") in abort.buttons:
            # Whoever wants it off is heard first.
            return True
        if not self._sessions.lasts(session):
            self.end_sessions()
            return False
        self._sessions.use(session)
        return True

    def _client(self, sid: str, message: Any) -> Client | None:
        """Return the page that a message is for, if it comes from the page's own session."""
        named = message.get("client_id") if isinstance(message, dict) else None
        client = Client.instances.get(named) if isinstance(named, str) else None
        session = _session_of(client) if client is not None else None
        return client if session is not None and session is _session_in(self._server.get_environ(sid)) else None


def _session_of(client: Client) -> Session | None:
    return getattr(client.request.state, "session", None)


def _session_in(environ: Mapping[str, Any] | None) -> Session | None:
    session: Session | None = (environ or {}).get("asgi.scope", {}).get("state", {}).get("session")
    return session
