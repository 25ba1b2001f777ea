"""As much of HTTP/1.1 as a control endpoint on loopback needs: JSON in, JSON out."""

import asyncio
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

_LARGEST_BODY = 1 << 16
_IDLE_TIME = 300.0
_REQUEST_TIME = 10.0
_OWN_NAMES = ("127.0.0.1", "localhost", "[::1]")
_REASONS = {
    200: "OK",
    400: "Bad Request",
    403: "Forbidden",
    404: "Not Found",
    405: "Method Not Allowed",
    409: "Conflict",
    411: "Length Required",
    413: "Content Too Large",
    415: "Unsupported Media Type",
    431: "Request Header Fields Too Large",
    500: "Internal Server Error",
}

#: Does what a request wants and returns what JSON can carry; the argument is the request's object, None for GET and DELETE.
Handler = Callable[[Any], Any]
#: Handlers by path, then method.
Routes = Mapping[str, Mapping[str, Handler]]


class RequestError(Exception):
    """A request that is refused, with the status and the words of the answer."""

    def __init__(self, status: int, words: str) -> None:
        self.status = status
        super().__init__(words)


@dataclass(frozen=True)
class _Request:
    method: str
    path: str
    headers: Mapping[str, str]

    @property
    def lasting(self) -> bool:
        return self.headers.get("connection", "").lower() != "close"


class JsonService:
    """Serves connections that a TcpService hands over. Handlers run one at a time, so they must not wait."""

    def __init__(self, routes: Routes) -> None:
        self._routes = routes

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer requests of one client until it leaves or has been idle for five minutes."""
        lasting = True
        while lasting:
            try:
                async with asyncio.timeout(_IDLE_TIME):
                    head = await reader.readuntil(b"\r\n\r\n")
                request = _parse(head)
                # After a body that was not read, there is no telling where the next request begins.
                body = await _body(reader, request)
                status, answer, lasting = 200, self._answer(request, body), request.lasting
            except asyncio.LimitOverrunError:
                status, answer, lasting = 431, {"error": "the request's head is too long"}, False
            except _BodyUnreadError as error:
                status, answer, lasting = error.status, {"error": str(error)}, False
            except RequestError as error:
                status, answer = error.status, {"error": str(error)}
            writer.write(_encoded(status, answer, lasting))
            await writer.drain()

    def _answer(self, request: _Request, body: bytes) -> Any:
        methods = self._routes.get(request.path)
        if methods is None:
            raise RequestError(404, f"{request.path} is not known; there are {', '.join(self._routes)}")
        handler = methods.get(request.method)
        if handler is None:
            raise RequestError(405, f"{request.method} {request.path} is not allowed; use {', '.join(methods)}")
        given = _json(request, body) if request.method == "POST" else None
        try:
            return handler(given)
        except RequestError:
            raise
        except (ValueError, RuntimeError) as error:
            raise RequestError(409, str(error)) from error
        except Exception as error:
            raise RequestError(500, f"{type(error).__name__}: {error}") from error


class _BodyUnreadError(RequestError):
    """Refused before the body was read."""


def _parse(head: bytes) -> _Request:
    lines = head.decode("latin-1").split("\r\n")
    words = lines[0].split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        raise _BodyUnreadError(400, "this is no request of HTTP/1.1")
    headers: dict[str, str] = {}
    for line in filter(None, lines[1:]):
        name, colon, value = line.partition(":")
        if not colon or name != name.strip():
            raise _BodyUnreadError(400, "a header of the request has no name")
        headers[name.lower()] = value.strip()
    # A web page that a browser shows must not reach the bench under a name of its own.
    if headers.get("host", "").rsplit(":", 1)[0] not in _OWN_NAMES:
        raise _BodyUnreadError(403, f"the host must be one of {', '.join(_OWN_NAMES)}")
    return _Request(words[0], words[1], headers)


async def _body(reader: asyncio.StreamReader, request: _Request) -> bytes:
    if "transfer-encoding" in request.headers:
        raise _BodyUnreadError(411, "give the body's Content-Length; no other transfer encoding is understood")
    length = request.headers.get("content-length", "0")
    if not (length.isascii() and length.isdigit()):
        raise _BodyUnreadError(400, f"Content-Length {length!r} is no number")
    if len(length) > 9 or int(length) > _LARGEST_BODY:
        raise _BodyUnreadError(413, f"the body may have up to {_LARGEST_BODY} bytes")
    async with asyncio.timeout(_REQUEST_TIME):
        return await reader.readexactly(int(length))


def _json(request: _Request, body: bytes) -> dict[str, Any]:
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise RequestError(415, "the body must be application/json")
    try:
        given = json.loads(body, object_pairs_hook=_unique, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise RequestError(400, f"the body is not valid JSON: {error}") from error
    if not isinstance(given, dict):
        raise RequestError(400, "the body must be a JSON object")
    return given


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) != len(pairs):
        raise ValueError("a key stands twice in one object")
    return made


def _refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} is no number in JSON")


def _encoded(status: int, answer: Any, lasting: bool) -> bytes:
    content = json.dumps(answer, ensure_ascii=False, allow_nan=False, default=_plain).encode("utf-8", "replace") + b"\n"
    head = (
        f"HTTP/1.1 {status} {_REASONS[status]}\r\nContent-Type: application/json\r\n"
        f"Content-Length: {len(content)}\r\nConnection: {'keep-alive' if lasting else 'close'}\r\n\r\n"
    )
    return head.encode("ascii") + content


def _plain(value: Any) -> Any:
    if hasattr(value, "item"):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no form in JSON")
