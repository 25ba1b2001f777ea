"""The control endpoint on loopback: JSON in, JSON out, over HTTP/1.1 as h11 reads and writes it."""

import inspect
import json
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any

import h11

from sim_instruments.transports.client import Client, Patience

_LARGEST_HEAD = _LARGEST_BODY = 1 << 16
_CHUNK = 1 << 12
#: How long a client is waited for.
PATIENCE = Patience(idle=300.0, half=10.0)
_OWN_NAMES = ("127.0.0.1", "localhost", "[::1]")

#: Does what a request wants and returns what JSON can carry; the argument is the request's object, None for GET and DELETE.
#: One that has to wait for somebody gives a coroutine, and only its own client waits for that.
Handler = Callable[[Any], Any]
#: Handlers by path, then method.
Routes = Mapping[str, Mapping[str, Handler]]


class RequestError(Exception):
    """A request that is refused, with the status and the words of the answer."""

    def __init__(self, status: int, words: str) -> None:
        self.status = status
        super().__init__(words)


class _BodyUnreadError(RequestError):
    """Refused before the body was read: where the next request begins, nobody can tell."""


class JsonService:
    """Serves connections that a TcpService hands over. Handlers run one at a time, so they must not block."""

    def __init__(self, routes: Routes) -> None:
        self._routes = routes

    async def serve(self, client: Client) -> None:
        """Answer requests of one client until it leaves."""
        http = h11.Connection(h11.SERVER, max_incomplete_event_size=_LARGEST_HEAD)
        while http.our_state is h11.IDLE:
            lasting: list[tuple[str, str]] = []
            try:
                request = await _event(http, client)
                if not isinstance(request, h11.Request):
                    return
                status, answer = 200, await self._answer(request, await _body(http, client, request))
            except h11.RemoteProtocolError as error:
                status, answer = error.error_status_hint, {"error": f"this is no request of HTTP/1.1: {error}"}
            except RequestError as error:
                status, answer = error.status, {"error": str(error)}
                if isinstance(error, _BodyUnreadError):
                    lasting = [("Connection", "close")]
            await client.send(_encoded(http, status, answer, lasting))
            if http.states == {h11.CLIENT: h11.DONE, h11.SERVER: h11.DONE}:
                http.start_next_cycle()

    async def _answer(self, request: h11.Request, body: bytes) -> Any:
        path, method = request.target.decode("latin-1"), request.method.decode("latin-1")
        methods = self._routes.get(path)
        if methods is None:
            raise RequestError(404, f"{path} is not known; there are {', '.join(self._routes)}")
        handler = methods.get(method)
        if handler is None:
            raise RequestError(405, f"{method} {path} is not allowed; use {', '.join(methods)}")
        given = _json(request, body) if method == "POST" else None
        try:
            answer = handler(given)
            return await answer if inspect.isawaitable(answer) else answer
        except RequestError:
            raise
        except (ValueError, RuntimeError) as error:
            raise RequestError(409, str(error)) from error
        except Exception as error:
            raise RequestError(500, f"{type(error).__name__}: {error}") from error


async def _event(http: h11.Connection, client: Client) -> Any:
    while (event := http.next_event()) is h11.NEED_DATA:
        begun = http.their_state is not h11.IDLE or bool(http.trailing_data[0])
        http.receive_data(await client.read(_CHUNK, begun=begun))
    return event


async def _body(http: h11.Connection, client: Client, request: h11.Request) -> bytes:
    # A web page that a browser shows must not reach the bench under a name of its own.
    if _header(request, b"host").rsplit(":", 1)[0] not in _OWN_NAMES:
        raise _BodyUnreadError(403, f"the host must be one of {', '.join(_OWN_NAMES)}")
    if _header(request, b"transfer-encoding"):
        raise _BodyUnreadError(411, "give the body's Content-Length; no other transfer encoding is understood")
    if int(_header(request, b"content-length") or 0) > _LARGEST_BODY:
        raise _BodyUnreadError(413, f"the body may have up to {_LARGEST_BODY} bytes")
    body = b""
    while isinstance(event := await _event(http, client), h11.Data):
        body += event.data
    return body


def _header(request: h11.Request, name: bytes) -> str:
    return next((value.decode("latin-1") for known, value in request.headers if known == name), "")


def _json(request: h11.Request, body: bytes) -> dict[str, Any]:
    kind = _header(request, b"content-type").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise RequestError(415, "the body must be application/json")
    try:
        result = json.loads(body, object_pairs_hook=_unique, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise RequestError(400, f"the body is not valid JSON: {error}") from error
    if not isinstance(result, dict):
        raise RequestError(400, "the body must be a JSON object")
    return result


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) != len(pairs):
        raise ValueError("a key stands twice in one object")
    return result


def _refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} is no number in JSON")


def _encoded(http: h11.Connection, status: int, answer: Any, more: list[tuple[str, str]]) -> bytes:
    content = json.dumps(answer, ensure_ascii=False, allow_nan=False, default=_plain).encode("utf-8", "replace") + b"\n"
    headers = [("Content-Type", "application/json"), ("Content-Length", str(len(content))), *more]
    parts = (
        h11.Response(status_code=status, headers=headers, reason=HTTPStatus(status).phrase.encode()),
        h11.Data(data=content),
        h11.EndOfMessage(),
    )
    return b"".join(http.send(part) or b"" for part in parts)


def _plain(value: Any) -> Any:
    if hasattr(value, "item"):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no form in JSON")
