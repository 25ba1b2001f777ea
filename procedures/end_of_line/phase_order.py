"""Order of the phases: does forward rotation give A before B before C?"""

from typing import ClassVar

from GTC import ureal

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import Text, text
from procedures.core.actions import ALL_OPEN, CoupleDynamometer, ReleaseRotor, Terminal, phases_on
from procedures.core.bench import ProcedureError, Role
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.winding.wiring import Outcome
from procedures.verification import messages as words
from procedures.verification.check import Check
from procedures.verification.settings import TurnedWiringSettings
from procedures.verification.shaft_wiring import SEQUENCE


class PhaseOrderSettings(TurnedWiringSettings):
    """Settings of the order of the phases: those of the slow turn that shows it."""


class PhaseOrder(Procedure[PhaseOrderSettings]):
    """Order of the phases, +1 for A, B, C with the dynamometer turning forwards, −1 for A, C, B.

    The order of the letters against the direction of rotation is that of IEC 60034-8; forwards is the dynamometer's.
    """

    name: ClassVar[str] = "phase-order"
    title: ClassVar[str] = "Order of the phases"
    section: ClassVar[str] = "EOL2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("phase_order",)
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Turn, look, judge."""
        self.prepare()
        self.conclude(self.turn())

    @step("EOL2/1", "Open the terminals, couple the drive motor", by_hand=True)
    def prepare(self) -> None:
        """Leave nothing on the terminals but probes."""
        self.bench.perform(ALL_OPEN)
        self.bench.perform(ReleaseRotor())
        self.bench.perform(CoupleDynamometer())

    @step(
        "EOL2/2",
        "Probe three phases against an artificial star point, and turn the shaft slowly forwards",
        by_hand=True,
    )
    def turn(self) -> Check:
        """Return what the three channels show of each other."""
        channels = list(self.bench.oscilloscope.channels(ProbeKind.VOLTAGE))[:3]
        if len(channels) < 3:
            raise ProcedureError(
                text("the order of three phases needs three voltage probes, the station has {n}", n=len(channels))
            )
        return self.wiring.shaft.sequence(phases_on(channels))

    @step("EOL2/3", "The order of the phases: +1 for A, B, C, −1 for A, C, B")
    def conclude(self, seen: Check) -> None:
        """Report it; raises ProcedureError where three phases cannot be told."""
        if seen.outcome is not Outcome.PROVED:
            raise ProcedureError(
                text(
                    "the order of the phases cannot be told: {why}",
                    why=words.REASONS.get(seen.reason) or seen.evidence or words.OUTCOMES[seen.outcome.value],
                )
            )
        backwards = seen.reason == SEQUENCE
        if backwards:
            self.notice(
                "phase-order",
                text(
                    "with the dynamometer turning forwards the phases follow each other as A, C, B: two of the three wires {wires} are "
                    "interchanged. Exchanging any two puts the order right; which two it were, the order alone does not tell",
                    wires=[self._wire(terminal) for terminal in Terminal],
                ),
            )
        self.report(
            "phase_order",
            "1",
            ureal(-1.0 if backwards else 1.0, 0.0),
            section=self.section,
            estimator="order of the phases' voltages in time",
            convention="+1 for A, B, C with the dynamometer turning forwards, −1 for A, C, B",
        )

    def _wire(self, terminal: Terminal) -> Text:
        return words.wire(terminal.value, self.nameplate.wire_colours)
