"""A run, or a line, that stands still while its page is looked at: behind it is this process, which asks and does nothing."""

import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bench.eol.line.admission.serial_numbers import QueuedSerials
from bench.eol.line.batch_log import BatchMotor
from bench.eol.line.panel_channel import PanelChannel
from bench.eol.record import CheckRecord, MeasuredFigure
from bench.eol.verdict import Verdict
from bench.journal.stored_result import store_text
from bench.operators.operator_channel import OperatorLine
from bench.operators.panel_answers import told_options
from drivers.interfaces.text import text
from drivers.manual.supply import MODES, REGULATION
from procedures.core.actions import MarkRestPositions
from tests.bench.eol.motor_records import motor_record

_TOLD_EVERY = 0.4
_MISSING = text("no answer within {seconds} s", seconds=2)
_SUPPLY = {"role": "supply", "feeds": True, "found": "off", "values": [[0.0, "V"], [0.0, "A"]], "error": None}
#: What a run asks, and what its sources say; None where it asks nothing and its instruments are with the measurement.
QUESTIONS: Mapping[str, tuple[Mapping[str, Any] | None, Sequence[Mapping[str, Any]]]] = {
    "measuring": (None, [_SUPPLY]),
    "unknown": (
        {"kind": "action", "action": "Connect", "lines": [store_text(text("Connect, in this order:"))]},
        [{**_SUPPLY, "found": "silent", "values": [], "error": store_text(_MISSING)}],
    ),
    "doubt": (
        {
            "kind": "doubt",
            "lines": [
                store_text(
                    text(
                        "{quantity} {terminals}, reading {number} of {count}: it is {ratio} the other readings, "
                        "{value:.4g} {unit} against {others} {unit}",
                        quantity=text("resistance"),
                        terminals="A–B",
                        number=2,
                        count=3,
                        ratio=text("ten times"),
                        value=0.318,
                        unit="Ω",
                        others=["0.0318", "0.0319"],
                    )
                )
            ],
        },
        [_SUPPLY],
    ),
    "set": (
        {
            "kind": "confirm",
            "instrument": "supply",
            "task": store_text(text("Switch the supply's output on.")),
        },
        [{**_SUPPLY, "found": "by_hand", "values": []}],
    ),
    "choice": (
        {
            "kind": "number",
            "quantity": store_text(text("{instrument}, {quantity}", instrument=text("DC supply"), quantity=REGULATION)),
            **dict.fromkeys(("unit", "proposed", "minimum"), ""),
            "options": told_options([*MODES.values()]),
        },
        [{**_SUPPLY, "found": "by_hand", "values": []}],
    ),
    "angles": (
        {
            "kind": "angles",
            "action": "MarkRestPositions",
            "lines": [store_text(line) for line in MarkRestPositions().lines({})],
        },
        [_SUPPLY],
    ),
}


@contextmanager
def played_run(folder: Path, journal: Iterable[str], kind: str) -> Iterator[None]:
    """Have a run of this journal go on that asks a question of QUESTIONS, and has its sources say what stands there."""
    folder.mkdir(parents=True)
    (folder / "journal.jsonl").write_text("".join(journal))
    line, ended = OperatorLine(lambda _: None), threading.Event()
    question, sources = QUESTIONS[kind]
    line.say({"question": None if question is None else {"id": 1, **question}})

    def tell() -> None:
        while not ended.wait(_TOLD_EVERY):
            line.tell({"sources": sources})

    telling = threading.Thread(target=tell)
    telling.start()
    line.announce(folder)
    try:
        yield
    finally:
        ended.set()
        telling.join()
        line.close()


@contextmanager
def played_line(folder: Path) -> Iterator[None]:
    """Have a batch go on whose sockets stand in every state."""
    folder.mkdir(parents=True)
    channel = PanelChannel("B-0817", "lg-400w", [str(number) for number in range(1, 7)], QueuedSerials())
    low = MeasuredFigure("stator_resistance", 0.0193, "Ω", 1e-5, 2e-5, 0.0152, 0.0168, Verdict.FAIL)
    good = MeasuredFigure("stator_resistance", 0.0161, "Ω", 1e-5, 2e-5, 0.0152, 0.0168, Verdict.PASS)
    ends = (
        ("1", Verdict.PASS, (good,), ""),
        ("2", Verdict.FAIL, (low,), ""),
        ("3", Verdict.ERROR, (), "LCR meter: no answer within 2 s"),
        ("4", Verdict.ABORTED, (), "interrupted by J. Doe at the panel"),
    )
    for socket, verdict, measured, cause in ends:
        channel.begun(BatchMotor(int(socket), f"LG-2026-{socket:>06}"), socket)
        channel.done(
            motor_record(
                int(socket),
                socket=socket,
                serial_number=f"LG-2026-{socket:>06}",
                verdict=verdict,
                measured=measured,
                cause=cause,
                checks=(CheckRecord("stator-resistance", 1, verdict, 3.0, cause if verdict is Verdict.ERROR else ""),),
                first_pass=verdict is Verdict.PASS,
            )
        )
    channel.begun(BatchMotor(5, "LG-2026-000005"), "5")
    channel.open(folder, lambda _: None, lambda _serial, _person: None)
    try:
        yield
    finally:
        channel.close()
