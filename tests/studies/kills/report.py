"""What the trials came to, as one table with the worst first."""

from collections.abc import Sequence

from tests.studies.kills.trial import Trial

#: At least so many trials, and with something energised, make the study.
TRIALS, ENERGISED = 500, 300
_HEAD = (
    "| what was done | trials | energised | off later than promised | off after the first unanswered call (s): median, longest "
    "| off after the disturbance (s): median, longest | events missing | hangs | traces | other faults |"
)


def table(found: Sequence[Trial]) -> str:
    """Return the table, the kinds with most broken promises first, then by the longest time."""
    kinds: dict[str, list[Trial]] = {}
    for trial in found:
        kinds.setdefault(trial.kind, []).append(trial)
    rows = sorted(kinds.items(), key=lambda pair: (-sum(not t.good for t in pair[1]), -max(t.off for t in pair[1])))
    lines = [_HEAD, "| --- |" + " ---: |" * 9]
    lines += [_row(kind, trials) for kind, trials in rows]
    return "\n".join([*lines, _row("all", list(found))])


def summary(found: Sequence[Trial]) -> str:
    """Return the targets in words."""
    on = [trial for trial in found if trial.energised]
    alone = [trial for trial in on if trial.without_computer]
    late = [trial for trial in on if trial.late]
    by_load = [trial for trial in late if trial.by_load]
    resumed = [trial for trial in found if trial.resumed]
    lines = [
        f"{len(found)} trials, {len(on)} of them with something energised.",
        f"Off later than promised: {len(late)}, in {len(by_load)} of these cases by no more than a thread of run, guardian or bench "
        "waited for a processor meanwhile, which of a run that computes says nothing, or the study itself did not look.",
        f"All of the computer's processes died: {len(alone)}; what has no watchdog of its own was on until the resume: "
        f"{sum('output_on' in trial.without_computer for trial in alone)}.",
        f"Events told and not in the journal: {sum(trial.missing for trial in found)}.",
        f"Starts that failed before anything was done and were repeated: {sum(len(trial.refused) for trial in found)}.",
        f"Resumed: {len(resumed)}, completed: {sum(trial.resumed == 'completed' for trial in resumed)}.",
    ]
    return "\n".join(lines)


def good(found: Sequence[Trial]) -> bool:
    """Tell whether every promise was kept."""
    return all(trial.good for trial in found)


def _row(kind: str, trials: Sequence[Trial]) -> str:
    on = [trial for trial in trials if trial.energised and not trial.without_computer]
    calls = [trial.unanswered for trial in on if trial.unanswered is not None]
    hangs = sum(any(fault.startswith("hangs") for fault in trial.faults) for trial in trials)
    traces = sum(any("traceback" in fault or "fault of the program" in fault for fault in t.faults) for t in trials)
    others = sum(
        any(not fault.startswith(("hangs", "a traceback", "a fault of the program")) for fault in t.faults)
        for t in trials
    )
    cells = [
        kind,
        str(len(trials)),
        str(sum(trial.energised for trial in trials)),
        str(sum(trial.late for trial in trials)),
        _times(calls),
        _times([trial.off_after for trial in on]),
        str(sum(trial.missing for trial in trials)),
        str(hangs),
        str(traces),
        str(others),
    ]
    return "| " + " | ".join(cells) + " |"


def _times(times: Sequence[float]) -> str:
    ordered = sorted(times)
    return f"{ordered[len(ordered) // 2]:.2f}, {ordered[-1]:.2f}" if ordered else "–"
