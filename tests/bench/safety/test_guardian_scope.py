"""A guardian in a systemd scope of its own: when one is taken, when not, and what of the run's line to it survives."""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from bench.journal.codec import RecordedEvent
from bench.journal.events.safety import GuardianStart
from bench.journal.guardian_record import read_guardian
from bench.safety.calls import CallWatches
from bench.safety.guardian.link import GuardianLink, Unguarded
from bench.safety.guardian.protocol import GuardianTask
from bench.safety.guardian.scope import Scope, guardian_scope
from bench.safety.interrupts import Interrupts
from bench.safety.liveness import ProgressStamps
from drivers.interfaces.text import text
from tests.journals import event

#: What `systemd-run --scope` does at its end: it becomes the command behind the dashes.
BECOMES = 'echo "$@" >> "$TOLD"\nwhile [ "$1" != -- ]; do shift; done\nshift\nexec "$@"\n'

Tools = Callable[..., Mapping[str, str]]


@pytest.fixture
def tools(tmp_path: Path) -> Tools:
    """Give an environment with a user's manager and a `systemd-run` of a few lines."""

    def made(script: str, *, runs: bool = True) -> Mapping[str, str]:
        folder = tmp_path / "bin"
        folder.mkdir()
        tool = folder / "systemd-run"
        tool.write_text("#!/bin/sh\n" + script)
        tool.chmod(0o755)
        if runs:
            (tmp_path / "systemd").mkdir()
            (tmp_path / "systemd" / "private").touch()
        path = f"{folder}{os.pathsep}{os.environ['PATH']}"
        return {"PATH": path, "XDG_RUNTIME_DIR": str(tmp_path), "TOLD": str(tmp_path / "told")}

    return made


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """Give what a process reads of itself that stands in another control group than everything started here."""
    file = tmp_path / "groups"
    file.write_text("1:name=systemd:/bench.service\n0::/bench.service\n")
    return file


def test_a_scope_of_the_users_manager(tools: Tools, elsewhere: Path, tmp_path: Path) -> None:
    environment = tools(BECOMES)
    scope = guardian_scope(environment, booted=tmp_path / "no", groups=elsewhere)
    assert scope.about() == {"scope": "user", "said": "the guardian has a systemd scope of its own (user manager)"}
    assert scope.prefix[1:3] == ("--user", "--scope")
    assert scope.environment == {"XDG_RUNTIME_DIR": str(tmp_path)}
    assert Path(environment["TOLD"]).read_text().endswith("-- cat /proc/self/cgroup\n")


def test_the_system_manager_where_the_users_refuses(tools: Tools, elsewhere: Path, tmp_path: Path) -> None:
    environment = tools('[ "$1" = --user ] && exit 1\n' + BECOMES)
    scope = guardian_scope(environment, booted=tmp_path, groups=elsewhere)
    assert (scope.manager, scope.prefix[1]) == ("system", "--system")


def test_what_stays_in_our_control_group_is_no_scope(tools: Tools, tmp_path: Path) -> None:
    scope = guardian_scope(tools(BECOMES), booted=tmp_path / "no")
    assert scope.prefix == ()
    assert scope.about() == {
        "scope": None,
        "said": "the guardian has no scope of its own and ends with the run's control group "
        "(user manager: it stays in the same control group)",
    }


def test_a_refusal_is_named(tools: Tools, tmp_path: Path) -> None:
    scope = guardian_scope(tools("echo 'Interactive authentication required.' >&2; exit 1"), booted=tmp_path)
    said = scope.about()["said"]
    assert "user manager: Interactive authentication required." in said
    assert "system manager: Interactive authentication required." in said


@pytest.mark.parametrize(
    ("given", "why"), [({"PATH": "/nowhere"}, "there is no systemd-run"), ({}, "no systemd manager is running")]
)
def test_nothing_is_tried_where_there_is_no_systemd(
    tools: Tools, tmp_path: Path, given: Mapping[str, str], why: str
) -> None:
    environment = {**tools(BECOMES, runs=False), **given}
    scope = guardian_scope(environment, booted=tmp_path / "no")
    assert why in scope.about()["said"]
    assert not Path(tmp_path / "told").exists()


def test_a_guardian_started_by_systemd_run_hears_and_answers(
    tools: Tools, elsewhere: Path, tmp_path: Path, station_of_a_bench: str
) -> None:
    environment = tools(BECOMES)
    scope = guardian_scope(environment, booted=tmp_path / "no", groups=elsewhere)
    scope = Scope(scope.said, scope.manager, scope.prefix, {**scope.environment, "TOLD": environment["TOLD"]})
    folder = tmp_path / "run"
    folder.mkdir()
    charge = GuardianTask("bench.toml", station_of_a_bench, ("supply",), str(folder), 0.6, 60.0)
    lifeline, kept = os.pipe()
    interrupts = Interrupts()
    link = GuardianLink(charge, ProgressStamps(), interrupts, CallWatches(interrupts, {}), scope, (kept,))
    os.close(kept)
    try:
        link.hear(event("energising", instrument="supply"))
        assert link.about() == GuardianStart("", **scope.about())
        assert Path(f"/proc/{link.pid}/exe").readlink().name.startswith("python")
        assert Path(environment["TOLD"]).read_text().splitlines()[-1].endswith("-m bench.safety.guardian")
    finally:
        assert link.dismiss(journal_lost=False) == ()
    # The descriptor that others learn by that it has ended was its own until then.
    assert os.read(lifeline, 1) == b""
    os.close(lifeline)
    events: list[RecordedEvent] = read_guardian(folder)
    assert [event.kind for event in events] == ["started", "ready", "left"]
    assert events[0].data["pid"] == link.pid


@pytest.fixture
def station_of_a_bench() -> str:
    # Nobody answers there: a guardian is ready all the same, and tries again when it must act.
    return """[station]
name = "bench"
[instruments.supply]
driver = "keysight-e36300"
address = "TCPIP0::127.0.0.1::9::SOCKET"
channel = 1
"""


def test_a_run_without_a_guardian_says_so() -> None:
    assert Unguarded().about() is None
    assert json.dumps(Scope(text("said")).about()) == '{"scope": null, "said": "said"}'
