"""The log of the panel's server: faults, but not browsers that left before they were answered."""

import logging

#: What Starlette raises where a browser is gone before its answer began (its issue 2516).
_LEFT = "No response returned."


def quieten_server() -> None:
    """Limit the server's log to warnings and faults."""
    log = logging.getLogger("uvicorn.error")
    log.setLevel(logging.WARNING)
    log.addFilter(_is_fault)


def _is_fault(record: logging.LogRecord) -> bool:
    error = record.exc_info[1] if record.exc_info else None
    return not (isinstance(error, RuntimeError) and str(error) == _LEFT)
