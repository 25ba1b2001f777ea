"""Permissions of the panel's pages in a browser: scripts of the panel alone, in no frame of another page."""

import secrets
from collections.abc import Callable, Sequence
from typing import Any

from jinja2 import BaseLoader, Environment

_POLICY = (
    "default-src 'none'",
    # Vue compiles templates and NiceGUI evaluates handlers in the browser; markup's own scripts and handlers do not run.
    "script-src 'self' 'nonce-{nonce}' 'unsafe-eval'",
    # The pages' head and Quasar write style sheets and style attributes.
    "style-src 'self' 'unsafe-inline'",
    "img-src 'self' data:",
    "font-src 'self'",
    "connect-src 'self'",
    "form-action 'self'",
    "base-uri 'none'",
    "frame-ancestors 'none'",
)


def new_nonce() -> str:
    """Return what marks the scripts of one answer as the panel's own."""
    return secrets.token_urlsafe(18)


def security_headers(nonce: str) -> Sequence[tuple[bytes, bytes]]:
    """Return the headers that every answer has; scripts within its markup need the nonce."""
    return (
        (b"content-security-policy", "; ".join(_POLICY).format(nonce=nonce).encode()),
        (b"x-frame-options", b"DENY"),
        (b"x-content-type-options", b"nosniff"),
        # Not "no-referrer": forms would then name no origin, which is what they are checked by.
        (b"referrer-policy", b"same-origin"),
        (b"cross-origin-opener-policy", b"same-origin"),
        (b"cross-origin-resource-policy", b"same-origin"),
        (b"permissions-policy", b"camera=(), microphone=(), geolocation=(), usb=(), serial=()"),
    )


def mark_scripts(environment: Environment) -> None:
    """Mark the scripts in templates, and no others, with the nonce of the request that they answer."""
    if environment.loader is None:
        raise TypeError("the templates have no loader")
    environment.loader = _MarkingLoader(environment.loader)


class _MarkingLoader(BaseLoader):
    def __init__(self, loader: BaseLoader) -> None:
        self._loader = loader

    def get_source(self, environment: Environment, template: str) -> tuple[str, Any, Callable[[], bool] | None]:
        source, path, is_current = self._loader.get_source(environment, template)
        return source.replace("<script", '<script nonce="{{ request.state.nonce }}"'), path, is_current
