"""Ld and Lq by a bridge on the aligned and locked rotor (§3.3.3)."""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import ClassVar

from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Aperture, ImpedanceReading, Wanted
from drivers.interfaces.text import text
from procedures.core.actions import (
    ALIGN_D,
    ALIGN_Q,
    LockRotor,
    ReleaseRotor,
    Terminal,
    UncoupleDynamometer,
    meter_across,
    meter_series_parallel,
)
from procedures.core.bench import Bench, Role
from procedures.core.demand import LOOP, Demand, Demands, Measurand
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.result import Notice
from procedures.core.steps import step
from procedures.estimation.fitting.repeats import mean_of_readings
from procedures.estimation.winding.connections import ReadingConnection, phase_factor
from procedures.estimation.winding.held_angle import held_angle
from procedures.estimation.winding.joined_lines import JoinedLines, LineReading, joined_lines
from procedures.estimation.winding.misalignment import Held, excess
from procedures.plausibility.inductance_capability import REQUESTED, check_inductance_capability
from procedures.techniques.repeated_readings import RepeatedQuantity, between, repeated_readings
from procedures.techniques.winding.alignment import aligning
from procedures.techniques.winding.dq_axes import connection_of, require
from procedures.techniques.winding.plots import aligned_plot
from procedures.techniques.winding.short_correction import short_correct
from procedures.techniques.winding.slow_inductance import (
    Slow,
    lower_readings,
    or_of_joined_lines,
    shown_by,
    tell_meant,
)
from procedures.techniques.winding.supply_voltage import within_voltage
from procedures.verification.settings import SupplyWiringSettings

#: A saliency of so many standard uncertainties tells an angle.
_TELLING = 4.0
#: 95 % of a rectangular distribution reach beyond its half-width over this.
_TO_THE_MEAN = 1.1


class DqInductanceAlignedSettings(SupplyWiringSettings):
    """Settings of §3.3.3."""

    align_share: float = Field(
        default=1.0, gt=0.0, le=1.0, description="aligning current, at most this share of the rated current"
    )
    settle: float = Field(default=1.0, gt=0.0, le=60.0, description="time for the rotor to come to rest, s")
    frequency: float = Field(default=1000.0, gt=0.0, le=1e6, description="test frequency, Hz")
    level: float = Field(default=1.0, gt=0.0, le=20.0, description="test level, V rms")
    aperture: Aperture = Field(default=Aperture.LONG, description="measurement time")
    repeats: int = Field(default=5, ge=1, le=100, description="readings at each position")
    at_frequency: bool = Field(
        default=True,
        description="the inductance at the test frequency is meant; false: that for slow changes, whose interval reaches as far as closed "
        "circuits (in magnets, solid iron) may be hidden from the bridge",
    )
    short_correction: bool = Field(default=True, description="measure and subtract the leads first")
    requested_uncertainty: float = Field(
        default=REQUESTED,
        gt=0.0,
        lt=1.0,
        description="required relative standard uncertainty; if a bridge cannot reach it, this is reported beforehand",
    )
    check_alignment: bool = Field(
        default=True,
        description="also read two lines: their difference shows how far friction kept the rotor from its position, and is "
        "corrected for",
    )


@dataclass(frozen=True)
class Position:
    """Readings at one locked position: A against B and C (H), what lower frequencies say of it, and where the lines AB and CA were read,
    by how much AB reads more (H) and what all three show.
    """

    reading: UncertainReal
    slow: Slow
    beside: tuple[UncertainReal, JoinedLines] | None = None


class DqInductanceAligned(Procedure[DqInductanceAlignedSettings]):
    """Ld and Lq read A against B and C together, the rotor locked on d, then on q (§3.3.3)."""

    name: ClassVar[str] = "dq-inductance-aligned"
    title: ClassVar[str] = "dq inductance, aligned bridge"
    section: ClassVar[str] = "3.3.3"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY, Role.LCR_METER})
    gives: ClassVar[tuple[str, ...]] = ("d_axis_inductance", "q_axis_inductance")
    needs: ClassVar[Demands] = {Role.SUPPLY: LOOP, Role.LCR_METER: Demand((Measurand.INDUCTANCE,))}

    @classmethod
    def check_capability(
        cls, bench: Bench, nameplate: Nameplate, settings: DqInductanceAlignedSettings
    ) -> Sequence[Notice]:
        """Compare the bridge's accuracy at the type value with the requested uncertainty."""
        return check_inductance_capability(cls.name, bench, nameplate, settings, 1.5)

    def measure(self) -> None:
        """Align, lock and read: d first, then q."""
        #: Whether each alignment's connection had its continuity verified.
        self._verified: dict[str, bool] = {}
        with ExitStack() as energised:
            self.align_d(energised)
            self.lock_d(energised)
        d = self.read_d()
        with ExitStack() as energised:
            self.align_q(energised)
            self.lock_q(energised)
        q = self.read_q()
        self._conclude(d, q)

    @step(
        "3.3.3-d/1",
        "Supply on, up to {align_share:.0%} of the rated current: A to plus, B and C to minus",
        by_hand=True,
    )
    def align_d(self, energised: ExitStack) -> None:
        """Turn the rotor to the d axis."""
        self.bench.lcr_meter.configure(self.settings.frequency, self.settings.level, self.settings.aperture)
        if self.settings.short_correction:
            short_correct(self.bench, self.bench.lcr_meter)
        self.wiring.supply.connect(ALIGN_D, UncoupleDynamometer())
        self.bench.perform(ReleaseRotor())
        energised.enter_context(
            aligning(
                self.bench, within_voltage(self, self.aligning_current(self.settings.align_share)), self.settings.settle
            )
        )

    @step("3.3.3-d/2", "The rotor rests on d: lock it, then switch the supply off", by_hand=True)
    def lock_d(self, energised: ExitStack) -> None:
        """Lock the rotor before the current is switched off, so that cogging cannot move it."""
        self.bench.perform(LockRotor())
        self._verified["d"] = self.wiring.supply.held(ALIGN_D)
        energised.close()

    @step("3.3.3-d/3", "Read the inductance of A against B and C together", by_hand=True)
    def read_d(self) -> Position:
        """Return 1.5 times the d-axis inductance (H), and the lines' difference."""
        return self._read("d")

    @step("3.3.3-q/1", "Supply on: B to plus, C to minus, A open", by_hand=True)
    def align_q(self, energised: ExitStack) -> None:
        """Turn the rotor until its q axis is on phase A."""
        # Connected and verified while the shaft is still locked: nothing moves, and no EMF is in the reading.
        self.wiring.supply.connect(ALIGN_Q)
        self.bench.perform(ReleaseRotor())
        energised.enter_context(
            aligning(
                self.bench, within_voltage(self, self.aligning_current(self.settings.align_share)), self.settings.settle
            )
        )

    @step("3.3.3-q/2", "The rotor rests on q: lock it, then switch the supply off", by_hand=True)
    def lock_q(self, energised: ExitStack) -> None:
        """Lock before the current goes."""
        self.bench.perform(LockRotor())
        self._verified["q"] = self.wiring.supply.held(ALIGN_Q)
        energised.close()

    @step("3.3.3-q/3", "Read the inductance of A against B and C together", by_hand=True)
    def read_q(self) -> Position:
        """Return 1.5 times the q-axis inductance (H), and the lines' difference."""
        return self._read("q")

    def _read(self, axis: str) -> Position:
        bridge, at = self.bench.lcr_meter, (self.settings.frequency, self.settings.level, self.settings.aperture)
        connection = meter_series_parallel()
        require(connection_of(connection), ReadingConnection.SERIES_PARALLEL)
        self.wiring.bridge.connect(connection, *at)
        statistics, taken = self._repeated(f"L_{axis}", axis, "A–(B+C)")
        self.findings[f"reading_{axis}"] = float(statistics.x)
        self.bench.show(lambda: aligned_plot(self.findings["reading_d"], self.findings.get("reading_q")))
        reading = self.bench.uncertainties.instrument("LCR meter", statistics, taken.inductance_accuracy)
        lower = lower_readings(self, *at)
        beside = None
        if self.settings.check_alignment and not bridge.read_by_hand:
            beside = self._beside(axis, self._impedance(statistics, taken))
            lower = beside[1].without_loop(lower)
        slow = shown_by(self, connection, lower, (f"{axis}_axis_inductance",))
        if self.settings.at_frequency:
            slow = slow.at_frequency()
        elif beside is None:
            slow = or_of_joined_lines(slow, self)
        return Position(reading, slow, beside)

    def _beside(self, axis: str, reading: complex) -> tuple[UncertainReal, JoinedLines]:
        """Read AB and CA: return by how much AB reads more (H), and what they show beside A against B and C (Ω)."""
        ab, read_ab = self._line(axis, Terminal.A, Terminal.B)
        ca, read_ca = self._line(axis, Terminal.C, Terminal.A)
        lines = joined_lines(reading, read_ab, read_ca, self._angular())
        self.wiring.supply.aligned(
            ALIGN_D if axis == "d" else ALIGN_Q, held_angle(lines), continuous=self._verified[axis]
        )
        # The bridge's own errors are the same in both, and fall out of the difference.
        return ab - ca, lines

    def _line(self, axis: str, high: Terminal, low: Terminal) -> tuple[UncertainReal, LineReading]:
        at = (self.settings.frequency, self.settings.level, self.settings.aperture)
        direct = self.wiring.bridge.connect(meter_across(high, low), *at)
        mean, taken = self._repeated(f"L_{high.value}{low.value} on {axis}", axis, between((high, low)))
        # A bridge without a low frequency has the resistance at the test frequency only.
        return mean, LineReading(self._impedance(mean, taken), taken.resistance if direct is None else direct)

    def _impedance(self, inductance: UncertainReal, taken: ImpedanceReading) -> complex:
        return complex(taken.resistance, self._angular() * float(inductance.x))

    def _angular(self) -> float:
        return 2.0 * math.pi * self.settings.frequency

    def _repeated(self, what: str, axis: str, terminals: str) -> tuple[UncertainReal, ImpedanceReading]:
        quantity_read = RepeatedQuantity(terminals, Wanted.INDUCTANCE, (f"{axis}_axis_inductance",))
        readings = repeated_readings(self, quantity_read, self.settings.repeats)
        mean, uncertainty, freedom = mean_of_readings([r.inductance for r in readings])
        quantity = self.bench.uncertainties.statistical(
            text("repeats of {what}", what=what), mean, uncertainty, freedom
        )
        return quantity, readings[-1]

    def _allowed_for(self, at_d: Position, at_q: Position) -> tuple[UncertainReal, UncertainReal]:
        """Return the readings as they would be exactly on d and on q."""
        d, q = at_d.reading, at_q.reading
        if at_d.beside is None or at_q.beside is None:
            return d, q
        (off_d, lines_d), (off_q, lines_q) = at_d.beside, at_q.beside
        # Of the inductance along phase A's axis the loop of B and C takes nothing.
        on_d, on_q = 1.5 * lines_d.along, 1.5 * lines_q.along
        beside_d, beside_q = 1.5 * lines_q.across, 1.5 * lines_d.across
        # Without saliency there is no telling an angle, and nothing to allow for.
        if float((q - d).x) >= _TELLING * float((q - d).u):
            found = excess(Held(on_d, float(off_d.x)), Held(on_q, float(off_q.x)))
            self.findings |= {"off_d": found.angle_d, "off_q": found.angle_q}
            d -= _squared(float(d.x) - on_d + found.d, off_d)
            q -= _squared(float(q.x) - on_q + found.q, off_q)
            on_d, on_q = on_d - found.d, on_q - found.q
            beside_d, beside_q = beside_d + found.q, beside_q + found.d
        return self._of_phases(d, on_d - beside_d), self._of_phases(q, on_q - beside_q)

    def _of_phases(self, reading: UncertainReal, apart: float) -> UncertainReal:
        """Return a reading whose interval reaches the mean of an axis along phase A and across it, which are so much apart (H): turns that
        A has more than B and C make one larger, the other smaller.
        """
        limit = self.bench.uncertainties.limit(text("unlike phases"), 0.0, _TO_THE_MEAN * abs(apart) / 2.0)
        return reading + limit

    def _conclude(self, at_d: Position, at_q: Position) -> None:
        d, q = self._allowed_for(at_d, at_q)
        tell_meant(self, (at_d.slow, at_q.slow), self.settings.frequency, at_frequency=self.settings.at_frequency)
        factors = phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL)
        halved = {"d": 0.5 * float(d.x), "q": 0.5 * float(q.x)}
        self.findings["halved_readings"] = halved
        self.notice(
            "E1",
            text(
                "A against B and C together is 1.5 times the phase's inductance: the readings {d:.5g} µH and {q:.5g} µH are "
                "divided by 1.5. The note's example halves them, which holds between two lines only",
                d=1e6 * float(d.x),
                q=1e6 * float(q.x),
            ),
        )
        for name, reading, axis, slow in (
            ("d_axis_inductance", d * at_d.slow.ratio, "d", at_d.slow),
            ("q_axis_inductance", q * at_q.slow.ratio, "q", at_q.slow),
        ):
            self.report(
                name,
                factors.y_equivalent * reading,
                section="3.3.3",
                estimator="mean of the aligned readings, two thirds, at the test frequency"
                if self.settings.at_frequency
                else "mean of the aligned readings, two thirds, for slow changes",
                note_value=halved[axis],
                winding=float((factors.winding * reading).x) if self.is_delta else None,
                misfit=slow.misfit,
            )


def _squared(excess_read: float, difference: UncertainReal) -> UncertainReal:
    """Return an excess (H) with the uncertainty of the lines' difference, which it grows with the square of."""
    ratio = difference / float(difference.x) if float(difference.x) else difference
    return excess_read * ratio * ratio
