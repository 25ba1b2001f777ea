"""Our whole end-of-line path, by the runner of batches: scanned serial number, worker, run with its journal and guardian, record.

Prints a motor's serial number when its record is kept. The station's file names no instrument, so that only the framework costs time;
a plug-in's procedure gives the values. As at every real station each event of the journal is synced before the next one.
"""

import io
import sys
from pathlib import Path

from bench.eol.line.batch import run_batch
from bench.eol.line.batch_listener import BatchListener
from bench.eol.line.preparation.prepare import BatchRequest
from bench.eol.record import MotorRecord
from bench.eol.verdict import Verdict
from drivers.interfaces.text import Text

PROCEDURE = """
from typing import ClassVar
from drivers.interfaces.text import text
from procedures.core.bench import Role
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step

class Measured(Procedure[Settings]):
    name: ClassVar[str] = "measured"
    title: ClassVar[str] = "Measured"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str | ParameterDefinition, ...]] = tuple(
        ParameterDefinition(f"parameter_{n:02d}", f"P_{n}", "Ω", text("Parameter {n}", n=n)) for n in range(COUNT)
    )

    def measure(self) -> None:
        self.read()

    @step("9.9/1", "Read them")
    def read(self) -> None:
        for n in range(COUNT):
            value = self.bench.uncertainties.statistical("reading", (n + 1) * 1.01, (n + 1) * 1e-3)
            self.report(f"parameter_{n:02d}", value, section="9.9", estimator="reading")
"""


class Printing(BatchListener):
    """Prints what is kept; anything else ends the study."""

    def done(self, record: MotorRecord) -> None:
        if record.verdict is not Verdict.PASS:
            raise SystemExit(f"the motor did not pass: {record.cause}")
        print(record.serial_number, flush=True)

    def trouble(self, words: Text) -> None:
        raise SystemExit(str(words))


def main() -> None:
    folder, motors, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    (folder / "measured.py").write_text(f"COUNT = {count}\n{PROCEDURE}", encoding="utf-8")
    limits = (
        f'[[limit]]\nparameter = "parameter_{n:02d}"\nlow = {0.9 * (n + 1)}\nhigh = {1.1 * (n + 1)}\n'
        for n in range(count)
    )
    plan = '[plan]\nname = "whole"\nmotor = "lg-400w"\n[plugins]\nfiles = ["measured.py"]\n[[procedure]]\nname = "measured"\n'
    (folder / "plan.toml").write_text(plan + "".join(limits), encoding="utf-8")
    (folder / "station.toml").write_text('[station]\nname = "S"\n', encoding="utf-8")
    serials = folder / "serials.txt"
    serials.write_text("".join(f"P-{n:07d}\n" for n in range(1, motors + 1)), encoding="utf-8")
    request = BatchRequest(
        plan=folder / "plan.toml",
        station=str(folder / "station.toml"),
        runs=folder / "runs",
        serials=str(serials),
        records=str(folder / "records.sqlite"),
    )
    run_batch(request, Printing(), io.StringIO())


if __name__ == "__main__":
    main()
