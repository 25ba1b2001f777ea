"""Checks made, recorded, and a wrong connection mended or refused: what all ways of verifying share."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect, Mend
from procedures.core.bench import Bench, ProcedureError
from procedures.core.nameplate import Nameplate
from procedures.core.result import Parameter
from procedures.estimation.winding.wiring import Outcome
from procedures.verification import messages as words
from procedures.verification.check import Check, Connection, connection_record
from procedures.verification.lines import Lines
from procedures.verification.settings import WiringLevels


class WiringError(ProcedureError):
    """A connection is not as told, and was not put right."""


@dataclass(frozen=True)
class Proof:
    """What a procedure's checks need; `findings` get every check under "wiring", `notice` takes a warning."""

    bench: Bench
    nameplate: Nameplate
    levels: WiringLevels
    known: Mapping[str, Parameter]
    findings: dict[str, Any]
    notice: Callable[[str, Text], None]

    @property
    def lines(self) -> Lines:
        """The line resistances that this run knows."""
        return self.bench.standing.lines

    def verify(self, connection: Connection, check: Callable[[], Check], *beside: Connection) -> Check:
        """Check a connection that has been made; have a wrong one mended and check again, as often as the settings say.

        `beside` is what was fitted beside it and may be wrong as well. Raises WiringError where it stays wrong.
        """
        for attempt in range(self.levels.attempts):
            found = check()
            self.record(connection, found, *beside)
            if found.outcome is not Outcome.WRONG:
                break
            last = attempt + 1 == self.levels.attempts
            if last or not found.to_be_mended or not self._mended(found, (connection, *beside)):
                raise WiringError(
                    text(
                        "the wiring is not as told: {finding}. Put it right and begin again",
                        finding=self._finding(found),
                    )
                )
        if isinstance(connection, Connect):
            self.bench.standing.proved = found.outcome is Outcome.PROVED
        if found.outcome is Outcome.UNEXPLAINED and found.evidence is not None:
            self.notice(
                "wiring",
                text(
                    "{evidence}, and no single mistake explains it: look at clips and contacts. Leads longer than wiring_leads says, or a "
                    "winding much warmer or colder than when its resistance was read, do the same",
                    evidence=found.evidence,
                ),
            )
        return found

    def compare(
        self, connects: Sequence[Connect], check: Callable[[int], Check], read_again: Callable[[int], None]
    ) -> None:
        """Check connections by what was read on all of them; a wrong one is mended and read again."""
        found = [check(number) for number in range(len(connects))]
        wrong = next((number for number, one in enumerate(found) if one.outcome is Outcome.WRONG), None)
        if wrong is None:
            for connect, one in zip(connects, found, strict=True):
                self.record(connect, one)
            return
        looked = False

        def again() -> Check:
            nonlocal looked
            if looked:
                read_again(wrong)
            looked = True
            return check(wrong)

        self.verify(connects[wrong], again)

    def record(self, connection: Connection, found: Check, *beside: Connection) -> None:
        """Put a check into the journal and the findings."""
        entry = found.record()
        for made in (connection, *beside):
            entry |= connection_record(made)
        self.findings.setdefault("wiring", []).append(entry)
        self.bench.recorder.event("wiring_checked", **entry)

    def _mended(self, found: Check, made: tuple[Connection, ...]) -> bool:
        wanted = tuple(line for each in made for line in each.lines(self.nameplate.wire_colours))
        return self.bench.mended(Mend(self._finding(found), wanted))

    def _finding(self, found: Check) -> Text:
        named = words.found(found.possible, self.nameplate.wire_colours)
        if found.evidence is None:
            return named
        return Text("{mistakes} ({evidence})", {"mistakes": named, "evidence": found.evidence})
