import io

from rich.console import Console

from bench.run.progress import Progress
from tests.journals import event

STARTED = {"procedure": "inertia", "steps": {"3.5/2": "加速" * 60}}
STEP = {"step": "3.5/2", "text": "accelerate", "time": 1.0}


def test_a_terminal_shows_one_changing_line() -> None:
    said = io.StringIO()
    progress = Progress(
        Console(file=said, width=40, force_terminal=True), {"nameplate": "数据手册", "inertia": "转动惯量"}, live=True
    )
    for kind, data in (("procedure_started", STARTED), ("reading", {}), ("step_started", STEP), ("run_finished", {})):
        progress.hear(event(kind, **data))
    lines = said.getvalue().split("\r\x1b[2K")
    assert lines[1] == "[2/2] 转动惯量"
    assert lines[2].startswith("[2/2] 转动惯量  §3.5/2  加速")
    assert sum(2 if character > "\u2e7f" else 1 for character in lines[2]) <= 39
    assert lines[-1] == ""
    assert "\n" not in said.getvalue()


def test_a_log_gets_a_line_a_step() -> None:
    said = io.StringIO()
    progress = Progress(Console(file=said, width=200), {"inertia": "Inertia"}, live=True)
    progress.hear(event("procedure_started", procedure="inertia", steps={}))
    progress.hear(event("step_started", **STEP))
    progress.hear(event("run_finished"))
    assert said.getvalue() == "[1/1] Inertia  §3.5/2  accelerate\n"
