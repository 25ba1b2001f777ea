"""Findings that need the attention of a run's reader, the most important first."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from drivers.interfaces.text import Text, text
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Notice, ProcedureResult, Withheld
from procedures.estimation.fitting.misfit import Answer
from reports.tables.summary import other_warnings

#: Errata whose correction is in the figures: E9 asks for another instrument, E11 and E15 for another step.
_TO_DO = frozenset({"E9", "E11", "E15"})
_ERRATUM = re.compile(r"E\d+")
#: Findings that change nothing for the reader.
_KNOWN = frozenset({"instrument-choice", "speed-drift", "raised-step", "refused-commands"})
_CONTRADICTIONS = frozenset({"type-tolerance", "disagreement"})


class Rank(IntEnum):
    """The rank of a finding: a figure is missing, figures contradict, a condition was poor, or nothing to do."""

    MISSING = 0
    CONTRADICTION = 1
    CONDITION = 2
    KNOWN = 3


@dataclass(frozen=True)
class Attention:
    """One finding, its short name, and the procedure that would be repeated; empty for what concerns several."""

    rank: Rank
    identifier: str
    procedure: str
    message: Text


def ranked(
    parameters: ParameterSet, warnings: Sequence[tuple[str, Notice]], results: Mapping[str, ProcedureResult]
) -> list[Attention]:
    """Return what is not given and every warning once, the most important first."""
    missing: dict[tuple[str, str, str], list[Withheld]] = {}
    for reason in (reason for reasons in parameters.withheld.values() for reason in reasons):
        missing.setdefault((reason.procedure, reason.cause, str(reason.message)), []).append(reason)
    found = [
        Attention(Rank.MISSING, cause, procedure, _withheld(alike)) for (procedure, cause, _), alike in missing.items()
    ]
    given_by = {str(parameter.label): parameter.procedure for parameter in parameters.parameters.values()}
    for procedure, notice in other_warnings(parameters, warnings):
        rank = _rank(notice.identifier, results.get(procedure))
        # A warning of one figure: measuring that figure again is what may be done about it.
        of = procedure or given_by.get(str(notice.message.values.get("label", "")), "")
        found.append(Attention(rank, notice.identifier, of, notice.message))
    once = {(each.identifier, each.procedure, str(each.message)): each for each in found}
    return sorted(once.values(), key=lambda each: each.rank)


def _withheld(alike: Sequence[Withheld]) -> Text:
    """Return which figures are not given, and why; cause and procedure stand beside it."""
    return text("{names}: {why}", names=[reason.label for reason in alike], why=alike[0].message)


def is_erratum(identifier: str) -> bool:
    """Return whether a finding's short name is one that the documentation lists: E1 …"""
    return _ERRATUM.fullmatch(identifier) is not None


def _rank(identifier: str, result: ProcedureResult | None) -> Rank:
    if identifier in _CONTRADICTIONS or identifier.startswith("consistency-"):
        return Rank.CONTRADICTION
    if identifier in _KNOWN or (is_erratum(identifier) and identifier not in _TO_DO):
        return Rank.KNOWN
    answers = {
        row["answer"]
        for row in (result.findings.get("misfit", ()) if result is not None else ())
        if row["cause"] == identifier
    }
    return Rank.KNOWN if answers == {Answer.MODELLED.value} else Rank.CONDITION
