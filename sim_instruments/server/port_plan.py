"""The TCP port of each endpoint of a served bench."""

import itertools
import os
from collections.abc import Mapping


class UnknownEndpointError(ValueError):
    """A port for an endpoint that the bench does not have: its name, its way, and those `known`."""

    def __init__(self, name: str, way: str, known: tuple[str, ...]) -> None:
        self.name, self.way, self.known = name, way, known
        super().__init__(f"this bench has no endpoint {name}.{way}; its endpoints are {', '.join(known)}")


class PortError(OSError):
    """A port that cannot be had: of which `host`, for which `endpoint` (name and way), and the system's `reason`."""

    def __init__(self, endpoint: tuple[str, str], host: str, port: int, error: OSError) -> None:
        self.endpoint, self.host, self.port = endpoint, host, port
        self.reason = os.strerror(error.errno) if error.errno else str(error)
        super().__init__(error.errno, f"{host}:{port} for {'.'.join(endpoint)}: {self.reason}")


class PortPlan:
    """Gives each endpoint its port: that of `named`, by name and way, else the next from `base` on, else 0, a free one."""

    def __init__(self, named: Mapping[str, Mapping[str, int]] | None = None, base: int | None = None) -> None:
        self._named = {(name, way): port for name, ways in (named or {}).items() for way, port in ways.items()}
        self._others = itertools.repeat(0) if base is None else itertools.count(base)
        self._taken: list[tuple[str, str]] = []

    def take(self, name: str, way: str) -> int:
        """Return the port of an endpoint."""
        self._taken.append((name, way))
        if (name, way) in self._named:
            return self._named[name, way]
        return next(port for port in self._others if not port or port not in self._named.values())

    def check(self) -> None:
        """Raise UnknownEndpointError where an endpoint is named that nobody has taken a port for."""
        for name, way in self._named:
            if (name, way) not in self._taken:
                raise UnknownEndpointError(name, way, tuple(".".join(endpoint) for endpoint in self._taken))
