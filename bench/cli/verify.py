"""`motorbench results verify`: whether a run is as it was written."""

from pathlib import Path

from bench.cli.options import Json, Language, Runs
from bench.cli.output import print_json
from bench.i18n.language import language_of, translator
from bench.journal.run_folder import existing_run_folder
from bench.journal.verification import Integrity
from bench.journal.verify import verify as verify_run
from drivers.interfaces.text import text


def verify(
    run: str, *, sha256: str = "", json: Json = False, language: Language = "auto", runs: Runs = Path("runs")
) -> int:
    """Show whether a run's journal, waveforms and result are as they were written; the status is 0 only where they are.

    Parameters
    ----------
    run
        The run's folder, its name under `--runs`, or `latest`.
    sha256
        Hash of the journal's last event, from a note kept outside the run's folder.

    """
    folder = existing_run_folder(run, runs)
    verification = verify_run(folder, sha256.strip())
    if json:
        print_json(
            {
                "run": str(folder.path),
                "verdict": verification.verdict.value,
                "unproven": verification.unproven or None,
                "events": verification.events,
                "sha256": verification.last_hash,
                "waveforms": verification.waveforms,
                "findings": [
                    {"file": f.file, "line": f.line or None, "what": str(f.what)} for f in verification.findings
                ],
            }
        )
    else:
        translate = translator(language_of(language))
        print(f"{folder.path}: {translate(verification.verdict.value)}")
        for finding in verification.findings:
            print(f"  {finding.words.render(translate)}")
        for doubt in verification.doubts:
            print(f"  {doubt.render(translate)}")
        for said in (
            text(
                "journal    {count} whole events, the last with SHA-256 {hash}",
                count=verification.events,
                hash=verification.last_hash or "–",
            ),
            text("waveforms  {count} files compared", count=verification.waveforms),
        ):
            print(f"  {said.render(translate)}")
    return 0 if verification.verdict is Integrity.UNTOUCHED else 1
