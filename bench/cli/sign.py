"""`motorbench sign`: a run is signed off by who measured, checked or approved it."""

from datetime import UTC, datetime
from pathlib import Path

from bench.cli.options import Json, Language
from bench.cli.output import print_json
from bench.i18n.errors import UsageError
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import text


def sign(
    run: str,
    *,
    by: str,
    meaning: str = "measured",
    remark: str = "",
    language: Language = "auto",
    json: Json = False,
    runs: Path = Path("runs"),
) -> int:
    """Sign a run that has ended; its report shows the signature, and a later change of the run voids it.

    The name is taken at its word. Where accounts are to sign, with their passwords, sign at the panel.

    Parameters
    ----------
    run
        The run's folder, its name under `--runs`, or latest.
    by
        The name of who signs.
    meaning
        Meaning of the signature: measured, checked or approved.
    remark
        Words that go with it.
    runs
        The folder of the runs.

    """
    from bench.journal.run_folder import existing_run_folder
    from bench.journal.signatures import MEANINGS, Meaning, signatures
    from bench.journal.signatures import sign as sign_run

    if meaning not in MEANINGS:
        raise UsageError(text("--meaning {meaning}: allowed are {names}", meaning=meaning, names=list(MEANINGS)))
    folder = existing_run_folder(run, runs)
    sign_run(folder, by, "at a terminal", remark, datetime.now(UTC), Meaning(meaning))
    made = signatures(folder)[-1]
    if json:
        print_json({"run": str(folder.path), "person": made.person, "meaning": made.meaning, "sha256": made.sha256})
        return 0
    message = text(
        "{run} is signed by {person}: {meaning} ({count} events, the last with SHA-256 {hash})",
        run=folder.path,
        person=made.person,
        meaning=MEANINGS[made.meaning],
        count=made.events,
        hash=f"{made.sha256[:16]}…",
    )
    print(message.render(translator(language_of(language))))
    return 0
