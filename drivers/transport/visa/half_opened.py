"""Sockets that PyVISA-py leaves open after a failed opening, until they are collected; some instruments accept only one
connection.
"""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

#: Attributes that hold a socket: of its HiSLIP connection, of its RPC client.
_SOCKETS = ("_sync", "_async", "sock")


@contextmanager
def sockets_closed_on_failure() -> Iterator[None]:
    """Close what an opening within the block has left where it fails; what PyVISA raises goes on."""
    try:
        yield
    except BaseException as error:
        for owner in _owners(error):
            for name in _SOCKETS:
                found = getattr(owner, name, None)
                if isinstance(found, socket.socket):
                    found.close()
        raise


def _owners(error: BaseException | None) -> Iterator[Any]:
    """Yield the objects whose methods an error has come through, and what they were connecting by."""
    while error is not None:
        trace = error.__traceback__
        while trace is not None:
            owner = trace.tb_frame.f_locals.get("self")
            yield owner
            yield vars(owner).get("interface") if hasattr(owner, "__dict__") else None
            trace = trace.tb_next
        error = error.__cause__ or error.__context__
