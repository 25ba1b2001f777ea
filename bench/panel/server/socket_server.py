"""Loads the pages' sockets as a server alone needs them."""

import importlib
import sys

#: HTTP clients and servers that the library of sockets takes where they are installed: 15 MB that nobody here calls.
_UNUSED = ("aiohttp", "tornado")


def load_socket_server() -> None:
    """Import the sockets' library without what only its clients need; whoever asks for that later has it."""
    absent = [name for name in _UNUSED if name not in sys.modules]
    # What stands so is to Python a package that is not installed.
    sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]
    try:
        importlib.import_module("socketio")
    finally:
        for name in absent:
            del sys.modules[name]
