"""Starts a guardian in its own systemd scope, if possible, so that it is not ended with the run's control group."""

import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drivers.interfaces.text import Text, text

#: How long (s) systemd may take to answer.
_PATIENCE = 5.0
#: There while the system manager is the first process (sd_booted(3)).
_BOOTED = Path("/run/systemd/system")
_GROUPS = Path("/proc/self/cgroup")
#: The control groups by which systemd knows whom to stop: the unified hierarchy, and the named one of version 1.
_BY_SYSTEMD = ("0::", ":name=systemd:")


@dataclass(frozen=True)
class Scope:
    """Start of a guardian: what stands before its command, what its environment needs besides, and what is said of it.

    `manager` is "user" or "system", empty where the guardian stays in the run's control group.
    """

    said: Text
    manager: str = ""
    prefix: tuple[str, ...] = ()
    environment: Mapping[str, str] = field(default_factory=dict)

    def about(self) -> dict[str, Any]:
        """Return what a run's record says of it."""
        return {"scope": self.manager or None, "said": str(self.said)}


def guardian_scope(
    environment: Mapping[str, str] = os.environ, *, booted: Path = _BOOTED, groups: Path = _GROUPS
) -> Scope:
    """Return how to start a guardian: in a scope of the first manager that gives one, else beside the run.

    A scope counts only where a process started in it is seen to be in another control group than this one. `systemd-run --scope` becomes
    the command itself, so that pipes, other file descriptors and the process id stay what they are.
    """
    systemd_run = shutil.which("systemd-run", path=environment.get("PATH"))
    if systemd_run is None:
        return _without(text("there is no systemd-run"))
    reasons = []
    for manager, added in _managers(environment, booted):
        prefix = (
            systemd_run,
            f"--{manager}",
            "--scope",
            "--quiet",
            "--collect",
            "--no-ask-password",
            "--description=motorbench guardian",
            "--",
        )
        why = _refusal(prefix, {**environment, **added}, groups.read_text())
        if not why:
            message = text("the guardian has a systemd scope of its own ({manager} manager)", manager=manager)
            return Scope(message, manager, prefix, added)
        reasons.append(f"{manager} manager: {why}")
    return _without("; ".join(reasons) if reasons else text("no systemd manager is running"))


def _without(why: Text | str) -> Scope:
    return Scope(text("the guardian has no scope of its own and ends with the run's control group ({why})", why=why))


def _managers(environment: Mapping[str, str], booted: Path) -> Iterator[tuple[str, Mapping[str, str]]]:
    """Give the managers that run here, the likelier one first, and what reaching them needs in the environment."""
    # A service has no XDG_RUNTIME_DIR, although its user's manager may well run (loginctl enable-linger).
    runtime = environment.get("XDG_RUNTIME_DIR") or f"/run/user/{os.getuid()}"
    user = [("user", {"XDG_RUNTIME_DIR": runtime})] if (Path(runtime) / "systemd" / "private").exists() else []
    system: list[tuple[str, dict[str, str]]] = [("system", {})] if booted.is_dir() else []
    yield from (*system, *user) if os.getuid() == 0 else (*user, *system)


def _refusal(prefix: Sequence[str], environment: Mapping[str, str], ours: str) -> str:
    """Return why a scope cannot be had by this command, nothing where a process that is started by it gets one."""
    try:
        tried = subprocess.run(  # noqa: S603  systemd-run by its own path
            [*prefix, "cat", str(_GROUPS)],
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer for {_PATIENCE:g} s"
    except OSError as error:
        return str(error)
    if tried.returncode:
        return (tried.stderr.strip().splitlines() or [f"systemd-run ended with status {tried.returncode}"])[-1]
    if _known_to_systemd(tried.stdout) == _known_to_systemd(ours):
        return "it stays in the same control group"
    return ""


def _known_to_systemd(groups: str) -> list[str]:
    return [line for line in groups.splitlines() if any(mark in line for mark in _BY_SYSTEMD)]
