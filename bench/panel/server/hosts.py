"""The names that the panel answers to, and whether a request comes from one of its own pages."""

import re
from collections.abc import Iterable, Mapping
from ipaddress import ip_address
from typing import Any
from urllib.parse import urlsplit

from drivers.interfaces.text import Text, text

_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_HOST = re.compile(r"(?P<name>\[[0-9a-fA-F:.]+\]|[^\[\]:/?#@\s]+)(?::(?P<port>\d{1,5}))?")
_DEFAULT_PORTS = {"http": 80, "https": 443}
_READING = frozenset({"GET", "HEAD"})


class AllowedHosts:
    """The host names of a panel: loopback's, the address it was told to listen on, and those that were added.

    Where it listens on every address of the computer, the one that a connection came in on is right too: an address is
    not a name that somebody else's name server could give out.
    """

    def __init__(self, host: str, more: Iterable[str] = ()) -> None:
        self._names = {_plain(name) for name in (*_LOOPBACK, host, *more)}
        self._any_address = _is_unspecified(host)

    def refusal(self, scope: Mapping[str, Any]) -> Text | None:
        """Return why a connection is refused, or None: one host, and one of ours."""
        hosts = _headers(scope, b"host")
        match = _HOST.fullmatch(hosts[0]) if len(hosts) == 1 else None
        if match is not None and self._is_ours(_plain(match["name"]), scope):
            return None
        return text(
            "The panel does not answer to the host {host!r}. If this is its name or address, start it with "
            "motorbench serve --allow-host NAME.",
            host=", ".join(hosts)[:100],
        )

    def _is_ours(self, name: str, scope: Mapping[str, Any]) -> bool:
        server = scope.get("server")
        return name in self._names or (self._any_address and server is not None and name == _plain(str(server[0])))


def origin_refusal(scope: Mapping[str, Any]) -> Text | None:
    """Return why a connection is refused for the page that it comes from, or None.

    Whatever changes something, and every websocket, must name one of the panel's own pages as its origin; what names
    another page is refused in any case.
    """
    origins = _headers(scope, b"origin")
    changes = scope["type"] == "websocket" or scope["method"] not in _READING
    if not origins and not changes:
        # Images and scripts of another page name no origin; browsers tell of them in this way. A link may lead here.
        site, kind = _headers(scope, b"sec-fetch-site"), _headers(scope, b"sec-fetch-dest")
        if site in ([], ["same-origin"], ["none"]) or kind == ["document"]:
            return None
    if len(origins) == 1 and _origin(origins[0]) == _own_origin(scope):
        return None
    return text(
        "This request comes from {origin}, not from a page of the panel, and is refused. Behind a proxy with TLS, start "
        "the panel with motorbench serve --trusted-proxy ADDRESS, and have the proxy pass on Host and X-Forwarded-Proto.",
        origin=repr(", ".join(origins)[:100]) if origins else text("a program or page that names no origin"),
    )


def _own_origin(scope: Mapping[str, Any]) -> tuple[str, str, int] | None:
    scheme = {"ws": "http", "wss": "https"}.get(scope["scheme"], str(scope["scheme"]))
    hosts = _headers(scope, b"host")
    return _origin(f"{scheme}://{hosts[0]}") if len(hosts) == 1 else None


def _origin(words: str) -> tuple[str, str, int] | None:
    try:
        parts = urlsplit(words)
        port = parts.port or _DEFAULT_PORTS[parts.scheme]
    except (ValueError, KeyError):
        return None
    bare = not (parts.path or parts.query or parts.fragment or parts.username is not None)
    return (parts.scheme, _plain(parts.hostname), port) if bare and parts.hostname else None


def _headers(scope: Mapping[str, Any], name: bytes) -> list[str]:
    return [value.decode("latin-1") for key, value in scope["headers"] if key.lower() == name]


def _plain(name: str) -> str:
    """Return a name as names are compared: small letters, addresses in their shortest form and without brackets."""
    bare = name.strip("[]").lower()
    try:
        return ip_address(bare).compressed
    except ValueError:
        return bare


def _is_unspecified(host: str) -> bool:
    try:
        return ip_address(host).is_unspecified
    except ValueError:
        return False
