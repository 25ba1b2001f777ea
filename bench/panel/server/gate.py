"""Checks of every request before any page: host, origin, session, size; and the headers of every answer."""

import asyncio
from contextlib import suppress

from starlette.datastructures import MutableHeaders
from starlette.requests import cookie_parser
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bench.i18n.language import translator
from bench.panel.server.content_policy import new_nonce, security_headers
from bench.panel.server.hosts import AllowedHosts, origin_refusal
from bench.panel.server.sessions import AccessRight, Session, Sessions
from drivers.interfaces.text import Text, text

#: Largest body (bytes) of who has no session, and of who has one.
_LARGEST_UNKNOWN = 1 << 14
_LARGEST = 1 << 20
#: A body is there within this time (s).
_BODY_TIME = 20.0
#: Whether somebody has left is known within this time (s), also where much else goes on; only who waits for nothing any more waits for it.
_LOOK = 2.0
#: What servers note of a request that was left (no standard's number).
_LEFT = 499
LOGIN = "/login"
#: Of NiceGUI: its live connections, and scripts and styles, which are the same for everyone.
_LIVE = "/_nicegui_ws"
_FILES = "/_nicegui/"


class Gate:
    """An application behind checks; without `login` everyone who gets as far has a session of an engineer.

    `request.state` gets the `session` and the `nonce` that the answer's scripts carry.
    """

    def __init__(self, app: ASGIApp, *, hosts: AllowedHosts, sessions: Sessions, login: bool) -> None:
        self._app = app
        self._hosts = hosts
        self._sessions = sessions
        self._login = login

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a connection as ASGI has it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        # NiceGUI would write it into pages; the panel is not served under another's path.
        scope["headers"] = [(key, value) for key, value in scope["headers"] if key.lower() != b"x-forwarded-prefix"]
        state = scope.setdefault("state", {})
        state["nonce"] = new_nonce()
        answer = self._refusal(scope)
        if answer is None:
            state["session"], fresh = self._session(scope)
            answer = self._without_session(scope) if state["session"] is None else None
        if answer is not None:
            await _refuse(answer, scope, receive, _with_headers(send, state["nonce"]))
            return
        session: Session | None = state["session"]
        if scope["type"] == "websocket":
            await self._app(scope, receive, send)
            return
        cookie = session_cookie(session, scope) if fresh and session is not None else ""
        send = _with_headers(send, state["nonce"], cookie)
        try:
            async with asyncio.timeout(_BODY_TIME):
                body = await _body(receive, scope, _LARGEST if session is not None else _LARGEST_UNKNOWN)
        except TimeoutError:
            body = None
        if body is None:
            await _too_large(scope, receive, send)
            return
        asker = _Asker(receive)
        try:
            await self._app(scope, _again(body, asker), send)
        except RuntimeError as error:
            # Starlette's words where a page was left before it was answered: nobody misses the answer.
            if str(error) != "No response returned." or not await asker.has_left():
                raise
            # Whoever stands before this gate wants an answer all the same.
            await Response(status_code=_LEFT)(scope, asker, send)

    def _refusal(self, scope: Scope) -> Response | None:
        for refused in (self._hosts.refusal(scope), origin_refusal(scope)):
            if refused is not None:
                return _plain(refused, 403)
        return None

    def _session(self, scope: Scope) -> tuple[Session | None, bool]:
        """Return the session of a request, and whether it begins here."""
        cookies = _cookies(scope)
        session = self._sessions.find(cookies.get(Sessions.COOKIE))
        path = str(scope["path"])
        page = scope["type"] == "http" and not path.startswith((_LIVE, _FILES))
        if session is not None:
            if page:
                self._sessions.use(session)
            return session, False
        if self._login or not page:
            return None, False
        return self._sessions.open(AccessRight.ENGINEER, language=language_of(cookies)), True

    def _without_session(self, scope: Scope) -> Response | None:
        path = str(scope["path"])
        if scope["type"] == "http":
            if path == LOGIN and self._login:
                return None
            if path.startswith(_FILES) and not self._login:
                return None
            if scope["method"] in ("GET", "HEAD") and not path.startswith((_LIVE, _FILES)):
                return RedirectResponse(LOGIN, status_code=303)
        return _plain(text("This session has ended, or never began: open the panel anew, and log in."), 403)


def language_of(cookies: dict[str, str]) -> str:
    """Return the language that a browser was set to."""
    return "zh" if cookies.get("motorbench_language") == "zh" else "en"


def session_cookie(session: Session, scope: Scope) -> str:
    """Return the header that gives a browser its session: for no script, no other site, and no connection without TLS
    where this one has it.
    """
    secure = "; Secure" if scope["scheme"] == "https" else ""
    return f"{Sessions.COOKIE}={session.token}; Path=/; HttpOnly; SameSite=Strict{secure}"


def _cookies(scope: Scope) -> dict[str, str]:
    return cookie_parser(
        "; ".join(value.decode("latin-1") for key, value in scope["headers"] if key.lower() == b"cookie")
    )


def _plain(words: Text, status: int) -> Response:
    """Return an answer in both languages: nobody knows whose browser it is."""
    content = "\n".join(words.render(translator(language)) for language in ("en", "zh")) + "\n"
    return PlainTextResponse(content, status, headers={"cache-control": "no-store", "connection": "close"})


async def _refuse(answer: Response, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        if "websocket.http.response" not in scope.get("extensions", {}):
            await send({"type": "websocket.close", "code": 1008})
            return
    await answer(scope, receive, send)


async def _body(receive: Receive, scope: Scope, largest: int) -> bytes | None:
    """Return a request's body, counted as it comes; None for one that is too large."""
    for key, value in scope["headers"]:
        if key.lower() == b"content-length" and (not value.isdigit() or len(value) > 12 or int(value) > largest):
            return None
    body = bytearray()
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return bytes(body)
        body += message.get("body", b"")
        if len(body) > largest:
            return None
        if not message.get("more_body", False):
            return bytes(body)


async def _too_large(scope: Scope, receive: Receive, send: Send) -> None:
    answer = _plain(text("The request's body is too large, or took too long."), 413)
    await answer(scope, receive, send)


class _Asker:
    """Whoever sent a request: what comes from there, and whether nobody is there any more."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._left = False

    async def __call__(self) -> Message:
        message = await self._receive()
        self._left = self._left or message["type"] == "http.disconnect"
        return message

    async def has_left(self) -> bool:
        """Say whether it has; where nobody has looked, a server tells it at once."""
        with suppress(TimeoutError):
            async with asyncio.timeout(_LOOK):
                while not self._left:
                    await self()
        return self._left


def _again(body: bytes, receive: Receive) -> Receive:
    """Return what gives a body that was read already, then whatever comes after it."""
    replayed = False

    async def again() -> Message:
        nonlocal replayed
        if replayed:
            return await receive()
        replayed = True
        return {"type": "http.request", "body": body, "more_body": False}

    return again


def _with_headers(send: Send, nonce: str, cookie: str = "") -> Send:
    async def sending(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            message["headers"] = list(message.get("headers", ()))
            headers = MutableHeaders(raw=message["headers"])
            for key, value in security_headers(nonce):
                headers[key.decode()] = value.decode()
            if cookie:
                headers.append("set-cookie", cookie)
        await send(message)

    return sending
