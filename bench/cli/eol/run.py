"""`motorbench eol run`: a batch of motors."""

import sys
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bench.cli.options import Json, Language, Seed
from bench.cli.output import print_json
from bench.eol.line.admission.next_motor import RefusedSerial
from bench.eol.line.batch import run_batch
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.brakes import AppliedBrake
from bench.eol.line.counts import Counts
from bench.eol.line.preparation.prepare import BatchRequest
from bench.eol.record import MotorRecord, label_of
from bench.eol.store.faults import StoreError
from bench.eol.store.waiting import Waiting
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError, UsageError
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, lines, text, text_of

#: The exit status of a batch that the line itself did not go on with.
_BRAKED = 3

if TYPE_CHECKING:
    from rich.console import Console


def run(
    plan: Path,
    *,
    station: str,
    sockets: int | None = None,
    batch: str = "",
    serials: Annotated[str, Parameter(allow_leading_hyphen=True)] = "",
    motors: int | None = None,
    first_serial: int = 1,
    records: str = "records.sqlite",
    runs: Path = Path("runs"),
    person: str = "",
    operator: str = "",
    again: bool = False,
    warm: bool = False,
    seed: Seed = 0,
    language: Language = "auto",
    json: Json = False,
) -> int:
    """Measure a batch of motors, several at once where there are several sockets; a batch that was cut off goes on.

    Exit status 0 where every motor passed, 1 where one did not, or was refused and not tested, or the batch was stopped, 3 where a
    brake or a golden motor that is due ended it.

    Parameters
    ----------
    plan
        The plan's file.
    station
        A station file, or `virtual`.
    sockets
        Number of virtual benches that work in parallel.
    batch
        The batch's name. Default: the plan's name. A batch that already exists is continued.
    serials
        Where the serial numbers come from: a file with one number a line, `-` (scanned or typed at the terminal, the default),
        or `panel` (at the panel of motorbench serve).
    motors
        Number of virtual motors in the batch. Their serial numbers are generated.
    first_serial
        Number in the first of the generated serial numbers.
    records
        Where the records are kept: a SQLite file, or postgresql://USER@HOST/NAME. While the server does not answer, the station
        keeps them in records.sqlite in the folder of its runs.
    runs
        Folder in which the batch's folder is created.
    person
        Name of the person who runs it, for the records.
    operator
        Who does the manual work. Default: the station's usual operator.
    again
        Measure motors again that the plan would refuse. Name the person responsible with --person NAME.
    warm
        Start without warming up, because the instruments have been on long enough. Name the person responsible with --person
        NAME.
    seed
        Seed of the virtual motors and benches.

    """
    if serials.startswith("-") and serials != "-":
        # What begins so is another option: its value was left out.
        raise UsageError(text("{name} needs a value.", name="--serials"))
    request = BatchRequest(
        plan=plan,
        station=station,
        runs=runs,
        sockets=sockets,
        batch=batch,
        serials=serials,
        motors=motors,
        first_serial=first_serial,
        records=records,
        person=person,
        operator=operator,
        language=language_of(language),
        seed=seed,
        again=again,
        warm=warm,
    )
    began = monotonic()
    translate = translator(request.language)
    listener = _Printer(console_on(sys.stderr if json else sys.stdout), translate)
    try:
        counts, stopped = run_batch(request, listener, sys.stdin)
    except StoreError as error:
        raise InputError(text_of(error)) from None
    summary = _summary(counts, stopped, monotonic() - began)
    if json:
        print_json(summary)
    else:
        _print(console_on(sys.stdout), summary, translate)
    if not (counts.motors or counts.refused or counts.unfinished or stopped):
        nothing = text(
            "nothing is left to test: all motors of this batch are on record. Give another --batch, more "
            "--motors, or --first-serial N"
        )
        print(f"motorbench: {nothing.render(translate)}", file=sys.stderr)
    if counts.waits.anything:
        for sentence in (
            *counts.waits.sentences(),
            text(
                "waiting records are forwarded with the next batch in this folder of runs, or by motorbench eol forward"
            ),
        ):
            print(f"motorbench: {sentence.render(translate)}", file=sys.stderr)
    for note in counts.undecidable:
        print(f"motorbench: {note.render(translate)}", file=sys.stderr)
    if stopped:
        sentence = text("the batch was stopped by {person}; the same command continues it", person=stopped)
        print(f"motorbench: {sentence.render(translate)}", file=sys.stderr)
    elif counts.no_verdict:
        sentence = text(
            "motors without a verdict: {count}. The same command tests them again; where serial numbers are scanned, scan them again",
            count=len(counts.no_verdict),
        )
        print(f"motorbench: {sentence.render(translate)}", file=sys.stderr)
    if counts.held_up is not None:
        print(f"motorbench: {counts.held_up.render(translate)}", file=sys.stderr)
    if counts.brakes and not stopped:
        # Why was said when each applied, maybe hundreds of motors ago.
        held = sorted({brake.socket for brake in counts.brakes})
        sentence = (
            text(
                "the plan's [brakes] ended the batch. Remove the cause that was given; the same command then continues it"
            )
            if "" in held
            else text("sockets that take no more motors: {sockets}. Remove the cause that was given", sockets=held)
        )
        print(f"motorbench: {sentence.render(translate)}", file=sys.stderr)
    if counts.unfinished:
        return _BRAKED
    passed = counts.verdicts[Verdict.PASS.value] == counts.motors
    return 0 if passed and not counts.untested and not stopped else 1


class _Printer(BatchListener):
    """Prints a line for each motor, and its label."""

    def __init__(self, console: "Console", translate: Translate) -> None:
        self._console = console
        self._translate = translate
        self._waits = Waiting()

    def done(self, record: MotorRecord) -> None:
        """Print the label and what was wrong."""
        self._line(label_of(record))
        if record.cause:
            self._line(f"    {record.cause}")
        if record.diagnosis:
            self._line(f"    → {record.rework}: {record.diagnosis}")

    def refused(self, refused: RefusedSerial) -> None:
        """Print why."""
        self._line(text("refused: {why}", why=refused.why).render(self._translate))

    def braked(self, brake: AppliedBrake) -> None:
        """Print why."""
        self.trouble(brake.why)

    def trouble(self, words: Text) -> None:
        """Print it."""
        self._line(f"motorbench: {words.render(self._translate)}")

    def noted(self, words: Text) -> None:
        """Print it."""
        self.trouble(words)

    def waits(self, waiting: Waiting) -> None:
        """Print what waits where the reasons are others than before, and that nothing does any more."""
        before, self._waits = self._waits, waiting
        if (before.troubles, before.refused) == (waiting.troubles, waiting.refused):
            return
        for sentence in waiting.sentences():
            self.trouble(sentence)
        if before.troubles and not waiting.troubles:
            self.trouble(text("records are stored and forwarded again"))

    def _line(self, words: str) -> None:
        self._console.file.write(words + "\n")
        self._console.file.flush()


def _summary(counts: Counts, stopped: str, wall: float) -> dict[str, Any]:
    return {
        "motors": counts.motors,
        **{verdict.value: counts.verdicts[verdict.value] for verdict in Verdict.of_motors()},
        "yield": {
            "motors": counts.by_motor.motors,
            "new": counts.by_motor.new,
            "first_pass": counts.by_motor.first_pass,
            "final": counts.by_motor.final,
        },
        "golden": dict(counts.golden),
        "refused": counts.refused,
        "untested": sorted(counts.untested),
        "no_verdict": sorted(counts.no_verdict),
        "bench_time": counts.bench_time,
        "wall_time": wall,
        "motors_per_second": counts.motors / wall if wall > 0.0 else 0.0,
        "waiting_for_server": counts.waits.for_server,
        "in_no_database": counts.waits.unstored,
        "refused_records": [
            {"identifier": refusal.identifier, "record": str(refusal.named), "why": str(refusal.why)}
            for refusal in counts.waits.refused
        ],
        "waits_because": [str(trouble.why) for trouble in counts.waits.troubles],
        "undecidable": [str(note) for note in counts.undecidable],
        "stopped": stopped,
        "brakes": [{"socket": brake.socket, "why": str(brake.why)} for brake in counts.brakes],
        "unfinished": counts.unfinished,
        "held_up": None if counts.held_up is None else str(counts.held_up),
    }


def _print(console: "Console", summary: dict[str, Any], translate: Translate) -> None:
    counts = {verdict.value: summary[verdict.value] for verdict in Verdict.of_motors()}
    sentences = [
        text(
            "tests: {motors}; {pass} passed, {fail} failed, {error} with an error, {aborted} aborted",
            motors=summary["motors"],
            **counts,
        ),
        text("serial numbers refused: {count}", count=summary["refused"]),
    ]
    if summary["yield"]["motors"]:
        sentences.insert(1, _yield(**summary["yield"]))
    if summary["golden"]:
        passed = text(
            "golden motors: {count} tests, {passed} passed",
            count=sum(summary["golden"].values()),
            passed=summary["golden"].get(Verdict.PASS.value, 0),
        )
        sentences.append(passed)
    pace = text(
        "{seconds:.1f} s, {rate:.2f} motors a second", seconds=summary["wall_time"], rate=summary["motors_per_second"]
    )
    console.file.write(f"{lines(sentences, between='; ').render(translate)}\n{pace.render(translate)}\n")


def _yield(motors: int, new: int, first_pass: int, final: int) -> Text:
    last = 100.0 * final / motors
    if not new:
        return text(
            "motors judged: {motors}, all judged before in earlier tests; yield {last:.1f} % at the last test",
            motors=motors,
            last=last,
        )
    first = 100.0 * first_pass / new
    if new < motors:
        return text(
            "motors judged: {motors}; yield {first:.1f} % at the first test (of the {new} that were never judged before), {last:.1f} % at "
            "the last",
            motors=motors,
            new=new,
            first=first,
            last=last,
        )
    return text(
        "motors judged: {motors}, yield {first:.1f} % at the first test, {last:.1f} % at the last",
        motors=motors,
        first=first,
        last=last,
    )
