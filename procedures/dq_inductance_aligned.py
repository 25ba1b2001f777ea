"""Ld and Lq by a bridge on the aligned and locked rotor (§3.3.3)."""

from contextlib import ExitStack
from typing import ClassVar

from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Aperture, Wanted
from procedures.actions import ALIGN_D, ALIGN_Q, LockRotor, ReleaseRotor, UncoupleDynamometer, meter_series_parallel
from procedures.alignment import aligning
from procedures.bench import Role
from procedures.estimation.connections import ReadingConnection, phase_factor
from procedures.estimation.repeats import mean_of_readings
from procedures.inductance import CONVENTION, connection_of, require, short_correct
from procedures.procedure import Procedure, Settings
from procedures.steps import step
from procedures.text import text


class DqInductanceAlignedSettings(Settings):
    """Settings of §3.3.3."""

    align_share: float = Field(default=0.3, gt=0.0, le=1.0, description="aligning current, share of the rated current")
    settle: float = Field(default=1.0, gt=0.0, le=60.0, description="time for the rotor to come to rest, s")
    frequency: float = Field(default=1000.0, gt=0.0, le=1e6, description="test frequency, Hz")
    level: float = Field(default=1.0, gt=0.0, le=20.0, description="test level, V rms")
    aperture: Aperture = Field(default=Aperture.LONG, description="measurement time")
    repeats: int = Field(default=5, ge=1, le=100, description="readings at each position")
    short_correction: bool = Field(default=True, description="measure and subtract the leads first")


class DqInductanceAligned(Procedure[DqInductanceAlignedSettings]):
    """Ld and Lq read A against B and C together, the rotor locked on d, then on q (§3.3.3)."""

    name: ClassVar[str] = "dq-inductance-aligned"
    title: ClassVar[str] = "dq inductance, aligned bridge"
    section: ClassVar[str] = "3.3.3"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY, Role.LCR_METER})
    gives: ClassVar[tuple[str, ...]] = ("d_axis_inductance", "q_axis_inductance")

    def measure(self) -> None:
        """Align, lock and read: d first, then q."""
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
        if self.settings.short_correction:
            self.bench.lcr_meter.configure(self.settings.frequency, self.settings.level, self.settings.aperture)
            short_correct(self.bench, self.bench.lcr_meter)
        if self.bench.has(Role.DYNAMOMETER):
            self.bench.perform(UncoupleDynamometer())
        self.bench.perform(ReleaseRotor())
        self.bench.perform(ALIGN_D)
        energised.enter_context(aligning(self.bench, self._align_current(), self.settings.settle))

    @step("3.3.3-d/2", "The rotor rests on d: lock it, then switch the supply off", by_hand=True)
    def lock_d(self, energised: ExitStack) -> None:
        """Lock before the current goes, so that cogging cannot move the rotor."""
        self.bench.perform(LockRotor())
        energised.close()

    @step("3.3.3-d/3", "Read the inductance of A against B and C together", by_hand=True)
    def read_d(self) -> UncertainReal:
        """Return 1.5 times the d-axis inductance (H)."""
        return self._read("d")

    @step("3.3.3-q/1", "Supply on: B to plus, C to minus, A open", by_hand=True)
    def align_q(self, energised: ExitStack) -> None:
        """Turn the rotor to where phase A sees its q axis."""
        self.bench.perform(ReleaseRotor())
        self.bench.perform(ALIGN_Q)
        energised.enter_context(aligning(self.bench, self._align_current(), self.settings.settle))

    @step("3.3.3-q/2", "The rotor rests on q: lock it, then switch the supply off", by_hand=True)
    def lock_q(self, energised: ExitStack) -> None:
        """Lock before the current goes."""
        self.bench.perform(LockRotor())
        energised.close()

    @step("3.3.3-q/3", "Read the inductance of A against B and C together", by_hand=True)
    def read_q(self) -> UncertainReal:
        """Return 1.5 times the q-axis inductance (H)."""
        return self._read("q")

    def _align_current(self) -> float:
        share = min(self.settings.align_share, self.bench.supply.maximum_current / self.nameplate.rated_current)
        return self.current_level(share, "aligning current")

    def _read(self, axis: str) -> UncertainReal:
        bridge = self.bench.lcr_meter
        connection = meter_series_parallel()
        require(connection_of(connection), ReadingConnection.SERIES_PARALLEL)
        self.bench.perform(connection)
        bridge.configure(self.settings.frequency, self.settings.level, self.settings.aperture)
        readings = [bridge.measure(Wanted.INDUCTANCE) for _ in range(self.settings.repeats)]
        mean, uncertainty, freedom = mean_of_readings([r.inductance for r in readings])
        self.findings[f"reading_{axis}"] = mean
        statistics = self.bench.uncertainties.statistical(f"repeats of L_{axis}", mean, uncertainty, freedom)
        return self.bench.uncertainties.instrument("LCR meter", statistics, readings[-1].inductance_accuracy)

    def _conclude(self, d: UncertainReal, q: UncertainReal) -> None:
        factors = phase_factor(self.winding, ReadingConnection.SERIES_PARALLEL)
        halved = {"d": 0.5 * float(d.x), "q": 0.5 * float(q.x)}
        self.findings["halved_readings"] = halved
        self.notice(
            "E1",
            text(
                "A against B and C together is 1.5 times the phase's inductance: the readings {d:.4g} µH and {q:.4g} µH are "
                "divided by 1.5. The note's example halves them, which holds between two lines only",
                d=1e6 * float(d.x),
                q=1e6 * float(q.x),
            ),
        )
        for name, reading, axis in (("d_axis_inductance", d, "d"), ("q_axis_inductance", q, "q")):
            self.report(
                name,
                "H",
                factors.y_equivalent * reading,
                section="3.3.3",
                estimator="mean of the aligned readings, two thirds",
                note_value=halved[axis],
                convention=CONVENTION,
                winding=float((factors.winding * reading).x) if self.is_delta else None,
            )
