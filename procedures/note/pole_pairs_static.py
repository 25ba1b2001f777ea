"""Pole pairs of a motor with few of them: count the stable positions of one turn (§3.1.2.1)."""

import math
from contextlib import ExitStack
from typing import ClassVar

from GTC import ureal
from pydantic import Field

from drivers.interfaces.text import text
from procedures.core.actions import ALIGN_D, MarkRestPositions, ReleaseRotor, TurnToRest, UncoupleDynamometer
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import LOOP, Demands
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.mechanics import pole_pairs
from procedures.techniques.winding.alignment import aligning
from procedures.verification.settings import SupplyWiringSettings

#: A mark so near (rad) to the first one come round again is that one.
_CLOSE = math.radians(5.0)
#: Fewer positions than this have no spare: one that was missed changes the count.
_FEW = 3
#: Marks of one position lie within this (rad) of each other.
_SAME_PLACE = math.radians(10.0)


class PolePairsStaticSettings(SupplyWiringSettings):
    """Settings of §3.1.2.1."""

    current_share: float = Field(
        default=0.10, gt=0.0, le=1.0, description="supply's current limit, share of the rated current"
    )
    settle: float = Field(default=1.0, gt=0.0, le=60.0, description="time for the rotor to come to rest, s")
    turns: int = Field(default=1, ge=1, le=10, description="full turns over which positions are marked")


class PolePairsStatic(Procedure[PolePairsStaticSettings]):
    """Pole pairs from the stable positions of the energised rotor (§3.1.2.1)."""

    name: ClassVar[str] = "pole-pairs-static"
    title: ClassVar[str] = "Pole pairs by stable positions"
    section: ClassVar[str] = "3.1.2.1"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY})
    gives: ClassVar[tuple[str, ...]] = ("pole_pairs",)
    needs: ClassVar[Demands] = {Role.SUPPLY: LOOP}

    def measure(self) -> None:
        """Hold, turn, mark, count."""
        self.connect()
        with ExitStack() as energised:
            self.energise(energised)
            angles = self.mark()
        self.count(angles)

    @step("3.1.2.1/1", "Connect phase A to the supply's plus, B and C together to minus", by_hand=True)
    def connect(self) -> None:
        """Connect one phase to plus and the other two to minus. A current that was set and that the supply cannot give is refused first."""
        self._holding_current()
        self.wiring.supply.connect(ALIGN_D, UncoupleDynamometer(), ReleaseRotor())

    @step(
        "3.1.2.1/2",
        "Limit the supply to at most {current_share:.0%} of the rated current, switch on, turn the shaft until it snaps in",
        by_hand=True,
    )
    def energise(self, energised: ExitStack) -> None:
        """Leave the supply on until the stack is closed."""
        energised.enter_context(aligning(self.bench, self._holding_current(), self.settings.settle))
        self.bench.perform(TurnToRest())

    @step("3.1.2.1/3", "Mark every stable position over one full turn", by_hand=True)
    def mark(self) -> list[float]:
        """Return the marked angles (rad)."""
        return self.bench.angles(MarkRestPositions(self.settings.turns))

    @step("3.1.2.1/4", "The number of stable positions is the number of pole pairs")
    def count(self, angles: list[float]) -> None:
        """Report the smallest number of evenly spaced positions that fits the marks; also report the plain count."""
        if not angles:
            raise ProcedureError(
                text("no stable position was marked; is the supply on, and does the shaft turn freely?")
            )
        turns, span = self.settings.turns, max(angles) - min(angles)
        # Where the first position is marked once more at the end, it does not count again.
        closed = len(angles) > 1 and abs(abs(angles[-1] - angles[0]) - 2.0 * math.pi * turns) < _CLOSE
        marks = angles[:-1] if closed else angles
        pairs, concentration = pole_pairs.from_angles(marks)
        counted = len(marks) / turns
        self.findings |= {
            "marked_angles": marks,
            "closed": closed,
            "concentration": concentration,
            "counted": counted,
        }
        self._check_round(marks, pairs, span)
        if counted != pairs:
            self.notice(
                "marks",
                text(
                    "{counted:g} positions were marked, but their spacing fits {pairs} pole pairs: a mark was missed or made twice",
                    counted=counted,
                    pairs=pairs,
                ),
            )
        self.report(
            "pole_pairs",
            ureal(float(pairs), 0.0),
            section="3.1.2.1",
            estimator="smallest number of equal spacings that the marked angles fit",
            note_value=counted,
        )

    def _check_round(self, marks: list[float], pairs: int, span: float) -> None:
        """Refuse marks that do not go round the turns: a shaft that never got on looks like few pole pairs."""
        advice = text(
            "turn the shaft by hand until it snaps into the next position; if friction holds it, use more current "
            "(current_share). Mark every position until the first one is reached again, one turn after its first "
            "mark (10 190 370)"
        )
        if pairs == 1 and span < 2.0 * math.pi - _CLOSE:
            raise ProcedureError(
                text(
                    "the marks ({marks}) lie within {span:.0f}°: either the motor has one pole pair, or the shaft was not "
                    "turned on to the next position; {advice}",
                    marks=len(marks),
                    span=math.degrees(span),
                    advice=advice,
                )
            )
        found = pole_pairs.places(marks, pairs, self.settings.turns)
        spare = 0 if pairs < _FEW else max(1, pairs // 8)
        if (
            pairs - found.taken > spare
            or found.repeated > max(1, spare) * self.settings.turns
            or found.spread > _SAME_PLACE
        ):
            raise ProcedureError(
                text(
                    "the marks ({marks}) occupy {taken} of {pairs} evenly spaced positions, {repeated} of them "
                    "more than once, and leave a gap of {gap:.0f}°: there is not exactly one mark for each stable "
                    "position; {advice}",
                    marks=len(marks),
                    taken=found.taken,
                    pairs=pairs,
                    repeated=found.repeated,
                    gap=math.degrees(found.gap),
                    advice=advice,
                )
            )

    def _holding_current(self) -> float:
        return self.current_level("current_share", text("holding current"))
