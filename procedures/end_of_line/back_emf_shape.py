"""Shape of the back-EMF: are the three phases alike in size and spacing, and how far is each from a sine?"""

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import Accuracy, ProbeKind
from drivers.interfaces.text import text
from procedures.core.actions import ALL_OPEN, CoupleDynamometer, ReleaseRotor, phases_on
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.emf.emf_shape import EmfShape, emf_shape
from procedures.estimation.winding.unbalance import all_at_once, largest_deviation
from procedures.techniques.acquisition import ranged_record
from procedures.techniques.shaft.driven_shaft import driving_speed_rad
from procedures.verification.settings import TurnedWiringSettings

_PHASES = 3
_PER_CENT = 100.0
_THIRD = 2.0 * math.pi / 3.0
#: Pole pairs that are taken where none are known, so that the record is long enough.
_FEW = 1
#: Each figure is the largest of three, and which it is was not chosen beforehand: noise and the channels' own gains count more.
_LARGEST_OF_THREE = all_at_once(_PHASES, math.inf)


class BackEmfShapeSettings(TurnedWiringSettings):
    """Settings of the EMF's shape."""

    speed_share: float = Field(default=0.5, gt=0.0, le=1.0, description="speed, share of the rated speed")
    periods: float = Field(default=5.0, ge=2.0, le=1000.0, description="electrical periods of the record")
    points: int = Field(default=2000, ge=500, le=1_000_000, description="points of the record")
    harmonics: int = Field(default=40, ge=2, le=200, description="highest harmonic that counts as distortion")
    exchange: bool = Field(
        default=False, description="record with the probes on each other's phases too, so that their gains cancel"
    )


class BackEmfShape(Procedure[BackEmfShapeSettings]):
    """Symmetry of the three phases' EMF and its total harmonic distortion (IEC 61000-4-7), from one record of the driven motor.

    Against an artificial star point no harmonic of an order divisible by three is seen: as between two lines.
    """

    name: ClassVar[str] = "back-emf-shape"
    title: ClassVar[str] = "Shape of the back-EMF"
    section: ClassVar[str] = "L3"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("back_emf_unbalance", "back_emf_angle_deviation", "back_emf_thd")
    needs: ClassVar[Demands] = {Role.OSCILLOSCOPE: Demand(waveforms=True, probes={ProbeKind.VOLTAGE: 3})}
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Record, compare sizes and angles, and take the distortion."""
        self.prepare()
        shapes = self.record()
        self.compare_sizes(shapes)
        self.compare_angles(shapes)
        self.distortion(shapes)

    @step("L3/1", "Open the terminals, couple the drive motor", by_hand=True)
    def prepare(self) -> None:
        """Leave nothing on the terminals but probes."""
        self.bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())

    @step(
        "L3/2",
        "Probe three phases against an artificial star point, drive at {speed_share:.0%} of the rated speed, and record",
        by_hand=True,
    )
    def record(self) -> list[EmfShape]:
        """Return the shape of one record, or of three where the probes are exchanged: the second begins with phase B on channel 1."""
        channels = list(self.bench.oscilloscope.channels(ProbeKind.VOLTAGE))[:_PHASES]
        if len(channels) < _PHASES:
            raise ProcedureError(
                text("the shape of three phases needs three voltage probes, the station has {n}", n=len(channels))
            )
        #: Accuracy of each channel in the range that was chosen.
        self._accuracies: dict[int, Accuracy] = {}
        speed = driving_speed_rad(self.bench, self.nameplate, self.settings.speed_share)
        known = self.known_value("pole_pairs") or self.nameplate.pole_pairs or self.nameplate.expected.get("pole_pairs")
        record_time = self.settings.periods * 2.0 * math.pi / ((known or _FEW) * speed)
        shapes: list[EmfShape] = []
        for first in range(_PHASES if self.settings.exchange else 1):
            self.wiring.shaft.connect_probes(phases_on(channels, first))
            shape = self._recorded(channels, speed, record_time)
            if not known and not shapes:
                # With more pole pairs than were taken, a period has too few points for the harmonics.
                record_time = self.settings.periods / shape.frequency
                shape = self._recorded(channels, speed, record_time)
            shapes.append(shape)
        return shapes

    @step("L3/3", "Size: the largest deviation of a phase from the mean of the three, over the mean")
    def compare_sizes(self, shapes: Sequence[EmfShape]) -> None:
        """Report it; the channels' gains are in its budget as far as the probes were not exchanged."""
        unc, labels = self.bench.uncertainties, ("A", "B", "C")
        sizes: list[UncertainReal] = []
        for phase, label in enumerate(labels):
            seen = []
            for first, shape in enumerate(shapes):
                place = (phase - first) % _PHASES
                channel, accuracy = list(self._accuracies.items())[place]
                flux = float(shape.flux[place])
                own = unc.statistical(
                    text("fundamental of phase {phase}", phase=label),
                    flux,
                    flux * shape.flux_uncertainty * _LARGEST_OF_THREE,
                )
                gain = Accuracy(gain=accuracy.gain * _LARGEST_OF_THREE, source=accuracy.source)
                seen.append(unc.instrument(text("oscilloscope, channel {channel}", channel=channel), own, gain))
            sizes.append(sum(seen[1:], seen[0]) / len(seen))
        farthest = largest_deviation(sizes)
        self.findings |= {
            "flux_linkages": {label: float(size.x) for label, size in zip(labels, sizes, strict=True)},
            "unbalanced_phase": labels[farthest.place],
        }
        self.report(
            "back_emf_unbalance",
            _PER_CENT * farthest.share,
            section=self.section,
            estimator="largest deviation of a phase's fundamental from the mean of the three, over the mean",
        )

    @step("L3/4", "Spacing: the largest deviation of the angle between two phases from 120°")
    def compare_angles(self, shapes: Sequence[EmfShape]) -> None:
        """Report it in electrical degrees."""
        # Channel k of the record that began with phase f shows phase k + f.
        spacings = np.mean([np.roll(shape.spacings, first) for first, shape in enumerate(shapes)], axis=0)
        off = np.degrees(spacings - _THIRD)
        farthest = int(np.argmax(np.abs(off)))
        uncertainty = (
            math.degrees(max(s.spacing_uncertainty for s in shapes)) / math.sqrt(len(shapes)) * _LARGEST_OF_THREE
        )
        labels = ("AB", "BC", "CA")
        self.findings["spacings"] = dict(zip(labels, np.degrees(spacings).tolist(), strict=True))
        self.report(
            "back_emf_angle_deviation",
            self.bench.uncertainties.statistical(
                text("angle of the fundamentals, {pair}", pair=labels[farthest]), abs(float(off[farthest])), uncertainty
            ),
            section=self.section,
            estimator="largest deviation of the angle between two phases' fundamentals from 120°",
        )

    @step(
        "L3/5",
        "Distortion: rms of the harmonics 2 … {harmonics} over the fundamental, the largest of the three phases",
    )
    def distortion(self, shapes: Sequence[EmfShape]) -> None:
        """Report it; a channel's gain is the same for fundamental and harmonics and cancels."""
        thd = np.mean([np.roll(shape.thd, first) for first, shape in enumerate(shapes)], axis=0)
        uncertainty = max(shape.thd_uncertainty for shape in shapes) / math.sqrt(len(shapes)) * _LARGEST_OF_THREE
        largest, shape = int(np.argmax(thd)), shapes[0]
        self.findings |= {
            "thd": {label: _PER_CENT * float(value) for label, value in zip(("A", "B", "C"), thd, strict=True)},
            "harmonics": [_PER_CENT * float(value) for value in np.mean(np.abs(shape.harmonics), axis=0)],
            "frequency": shape.frequency,
            "forwards": shape.forwards,
        }
        self.report(
            "back_emf_thd",
            self.bench.uncertainties.statistical(
                text("harmonics of phase {phase}", phase="ABC"[largest]),
                _PER_CENT * float(thd[largest]),
                _PER_CENT * uncertainty,
            ),
            section=self.section,
            estimator="root of the harmonics' squares over the fundamental, noise taken out",
        )

    def _recorded(self, channels: Sequence[int], speed: float, record_time: float) -> EmfShape:
        scope, settings = self.bench.oscilloscope, self.settings
        if not scope.gives_waveforms:
            raise ProcedureError(
                text("the shape of a voltage needs its waveform, which this oscilloscope does not give")
            )
        scope.configure_acquisition(record_time, settings.points, 0.0)
        with self.bench.dynamometer.driving_speed(speed):
            rated = self.nameplate.rated_voltage
            start = 1.3 * settings.speed_share * rated if rated else 50.0
            waves = ranged_record(self.bench, dict.fromkeys(channels, start), 10.0 + record_time)
        self._accuracies = {channel: waves[channel].accuracy for channel in channels}
        return emf_shape(
            waves[channels[0]].time,
            np.vstack([waves[channel].values for channel in channels]),
            harmonics=settings.harmonics,
            resolution=[waves[channel].resolution for channel in channels],
        )
