"""Checks made, recorded, and a wrong connection mended or refused: what all ways of verifying share."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drivers.interfaces.text import Text, text
from procedures.core.actions import Connect, LinePair, Mend
from procedures.core.bench import Bench, ProcedureError
from procedures.core.events import WiringChecked
from procedures.core.nameplate import Nameplate
from procedures.core.result import Parameter
from procedures.estimation.winding.wiring import WiringOutcome
from procedures.verification import messages as words
from procedures.verification.check import Check, Connection, connection_record
from procedures.verification.lines import Lines
from procedures.verification.settings import AllWiringSettings


class WiringError(ProcedureError):
    """A connection is wrong, and was not corrected; `possible` are records of the mistakes that would look like it."""

    def __init__(self, message: Text, possible: Sequence[Mapping[str, Any]] = ()) -> None:
        super().__init__(message)
        self.possible = tuple(possible)


@dataclass
class ConnectionVerifier:
    """Checks the connections of one procedure; `findings` get every check under "wiring", `notice` takes a warning."""

    bench: Bench
    nameplate: Nameplate
    settings: AllWiringSettings
    known: Mapping[str, Parameter]
    findings: dict[str, Any]
    notice: Callable[[str, Text, Text | None], None]
    #: Line readings that were taken again so far, their connections being corrected.
    repeated: int = field(default=0, init=False)
    _odd: list[Text] = field(default_factory=list, init=False)
    _told: Text | None = field(default=None, init=False)

    @property
    def lines(self) -> Lines:
        """The line resistances that this run knows."""
        return self.bench.state.lines

    def verify(self, connection: Connection, check: Callable[[], Check], *beside: Connection) -> Check:
        """Check a connection that has been made; have a wrong one corrected and check again, as often as the settings say.

        `beside` is what was fitted beside it and may be wrong as well. Raises WiringError where it stays wrong.
        """
        for left in reversed(range(self.settings.wiring_attempts)):
            result = check()
            self.record(connection, result, *beside)
            if result.outcome is not WiringOutcome.WRONG:
                break
            self._have_corrected(result, (connection, *beside), last=not left)
        if isinstance(connection, Connect):
            self.bench.state.verified = result.outcome is WiringOutcome.VERIFIED
        if result.outcome is WiringOutcome.UNEXPLAINED and result.evidence is not None:
            self._tell_unexplained(result, result.evidence)
        return result

    def _tell_unexplained(self, check: Check, evidence: Text) -> None:
        """Warn of a connection that reads oddly: once a procedure, with how many others do."""
        self._odd.append(evidence)
        if len(self._odd) > 1:
            evidence = text(
                "{evidence} (and {count} further connections of this procedure as oddly, each in the findings)",
                evidence=self._odd[0],
                count=len(self._odd) - 1,
            )
        told = _unexplained(check, evidence)
        self.notice("wiring", told, self._told)
        self._told = told

    def lines_to_repeat(self, lines: Mapping[LinePair, Connect], checks: Sequence[Check]) -> tuple[LinePair, ...]:
        """Return the first line whose check is wrong, its connection being corrected; none where no check is wrong.

        Raises WiringError where it is not corrected, or a line was wrong as often as the settings allow.
        """
        wrong = next(
            ((pair, check) for pair, check in zip(lines, checks, strict=True) if check.outcome is WiringOutcome.WRONG),
            None,
        )
        if wrong is None:
            for connect, check in zip(lines.values(), checks, strict=True):
                self.record(connect, check)
            return ()
        pair, check = wrong
        self.record(lines[pair], check)
        self.repeated += 1
        self._have_corrected(check, (lines[pair],), last=self.repeated >= self.settings.wiring_attempts)
        return (pair,)

    def record(self, connection: Connection, check: Check, *beside: Connection) -> None:
        """Put a check into the journal and the findings."""
        entry = check.record()
        for each in (connection, *beside):
            entry |= connection_record(each)
        self.findings.setdefault("wiring", []).append(entry)
        self.bench.recorder.record(WiringChecked(**entry))

    def _have_corrected(self, check: Check, connections: tuple[Connection, ...], *, last: bool) -> None:
        """Have hands correct what a check found wrong. Raises WiringError where they cannot, or after the last attempt."""
        finding = words.found(check.possible, self.nameplate.wire_colours)
        if check.evidence is not None:
            finding = Text("{mistakes} ({evidence})", {"mistakes": finding, "evidence": check.evidence})
        if not last and check.correctable:
            expected = tuple(line for each in connections for line in each.lines(self.nameplate.wire_colours))
            if self.bench.mended(Mend(finding, expected)):
                return
        raise WiringError(
            text("the wiring is wrong: {finding}. Correct it and start again", finding=finding), check.possible
        )


def _unexplained(check: Check, evidence: Text) -> Text:
    """Return what to look at where neither the connection as intended nor any one mistake reads so."""
    if check.by == "oscilloscope" and "voltage" not in check.read:
        return text(
            "{evidence}, which no single wiring mistake explains: check clips and contacts. Other causes: a probe's factor that is not "
            "the one set for its channel, a channel that is AC coupled, or mains hum",
            evidence=evidence,
        )
    return text(
        "{evidence}, which no single wiring mistake explains: check clips and contacts. Other causes: leads "
        "of more resistance than the setting wiring_leads allows, or a winding much warmer or colder, or contacts much worse or better, "
        "than when its resistance was measured",
        evidence=evidence,
    )


class VerifiedWiring:
    """Connections of one kind, made and verified."""

    def __init__(self, verifier: ConnectionVerifier) -> None:
        self._verifier = verifier
        self._bench = verifier.bench
