"""Shape of the back-EMF: are the three phases alike in size and spacing, and how far is each from a sine?"""

import math
from collections.abc import Sequence
from dataclasses import replace
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
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.emf_shape import EmfShape, emf_shape
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
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
UNBALANCE, THD = "back_emf_unbalance", "back_emf_thd"
#: Channels that lost a part of the wave.
_LOST = frozenset({Cause.CLIPPED, Cause.DROPOUTS})
#: A bent wave is off by so many times the share of the fundamental that is told, and told from this share on.
_BENT, _SEEN_BENT = 1.4, 1e-3
#: A lag (rad) between two channels that is told, beyond so many of its standard uncertainties.
_LATE, _BEYOND = math.radians(1.0), 4.0
#: Frequencies (Hz) of an EMF from which a record does not part mains hum, and the share of the speed that is taken instead.
_MAINS, _SLOWER = (44.0, 68.0), 0.6
#: The second speed is such a share of the first, the first of them that is not within the mains' frequencies.
_SECOND = (0.6, 0.75, 0.45)
#: What filters hold of the distortion is told beyond so many standard uncertainties, and from this share of the fundamental on.
_FILTERED, _SEEN_FILTERED = 4.0, 1e-3
_TWO_SPEEDS = "emf-two-speeds"
#: What does not exceed so many standard uncertainties widens nothing.
_CHANCE = 1.5


class BackEmfShapeSettings(TurnedWiringSettings):
    """Settings of the EMF's shape."""

    speed_share: float = Field(default=0.5, gt=0.0, le=1.0, description="speed, share of the rated speed")
    periods: float = Field(default=5.0, ge=2.0, le=1000.0, description="electrical periods of the record")
    points: int = Field(default=2000, ge=500, le=1_000_000, description="points of the record")
    harmonics: int = Field(default=40, ge=2, le=200, description="highest harmonic that counts as distortion")
    exchange: bool = Field(
        default=False, description="record with the probes on each other's phases too, so that their gains cancel"
    )
    two_speeds: bool = Field(
        default=True, description="record at a lower speed as well, so that what filters the channels is seen"
    )
    both_ways: bool = Field(default=True, description="drive backwards as well, so that what delays a channel cancels")


class BackEmfShape(Procedure[BackEmfShapeSettings]):
    """Symmetry of the three phases' EMF and its total harmonic distortion (IEC 61000-4-7), from one record of the driven motor.

    Turned both ways, what a probe delays in time falls out of the spacings. Against an artificial star point no harmonic of an order
    divisible by three is seen: as between two lines.
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
        "Probe three phases against an artificial star point, drive at {speed_share:.0%} of the rated speed, forwards, then backwards, and "
        "record",
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
        #: What the records show beyond their models.
        self._misfits: list[Misfit] = []
        #: What filters of the channels have of the distortion, with its uncertainty, where a second speed tells it.
        self._lost: tuple[FloatArray, FloatArray] | None = None
        known = self.known_value("pole_pairs") or self.nameplate.pole_pairs or self.nameplate.expected.get("pole_pairs")
        record_time = self.settings.periods * 2.0 * math.pi / ((known or _FEW) * speed)
        shapes: list[EmfShape] = []
        #: As the shaft turns forwards, where a current in shorted turns makes one neighbour larger and the other smaller.
        self._forwards: list[EmfShape] = []
        for first in range(_PHASES if self.settings.exchange else 1):
            self.wiring.shaft.connect_probes(phases_on(channels, first))
            shape = self._recorded(channels, speed, record_time)
            mains = _MAINS[0] < shape.frequency < _MAINS[1]
            if not shapes and (mains or not known):
                # With more pole pairs than were taken, a period has too few points for the harmonics; and hum of the frequency of the
                # fundamental would be a part of it.
                speed = _SLOWER * speed if mains else speed
                record_time = self.settings.periods / (shape.frequency * (_SLOWER if mains else 1.0))
                shape = self._recorded(channels, speed, record_time)
            self._forwards.append(shape)
            if self.settings.two_speeds and not first:
                share = next(each for each in _SECOND if not _MAINS[0] < each * shape.frequency < _MAINS[1])
                self._lost = shape.lost(self._recorded(channels, share * speed, record_time / share))
            if self.settings.both_ways:
                back = self._recorded(channels, -speed, record_time)
                self._tell_lags(channels, shape, back)
                self._misfits.append(bent_by(channels, shape, back))
                shape = shape.with_backwards(back)
            shapes.append(shape)
        if self._lost is not None:
            self._misfits.append(filtered_by(channels, *self._lost))
        self._misfit = of_shape(Misfit.together(self._misfits), both_ways=self.settings.both_ways)
        return shapes

    @step("L3/3", "Size: the largest deviation of a phase from the mean of the three, over the mean")
    def compare_sizes(self, shapes: Sequence[EmfShape]) -> None:
        """Report it; the channels' gains are in its budget as far as the probes were not exchanged."""
        unc, labels = self.bench.uncertainties, ("A", "B", "C")
        sizes: list[UncertainReal] = []
        bent = _BENT * max(
            (float(f.figures.get("share", 0.0)) for f in self._misfit.of(UNBALANCE).findings), default=0.0
        )
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
                own = own * (1.0 + unc.limit("fundamental that a channel's distortion takes", 0.0, bent))
                seen.append(unc.instrument(text("oscilloscope, channel {channel}", channel=channel), own, gain))
            sizes.append(sum(seen[1:], seen[0]) / len(seen))
        farthest = largest_deviation(sizes)
        self.findings |= {
            "flux_linkages": {label: float(size.x) for label, size in zip(labels, sizes, strict=True)},
            "flux_linkages_forwards": {
                label: float(np.mean([s.flux[(phase - first) % _PHASES] for first, s in enumerate(self._forwards)]))
                for phase, label in enumerate(labels)
            },
            "unbalanced_phase": labels[farthest.place],
        }
        self.report(
            UNBALANCE,
            _PER_CENT * farthest.share,
            section=self.section,
            estimator="largest deviation of a phase's fundamental from the mean of the three, over the mean",
            misfit=self._misfit.of(UNBALANCE),
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
            THD,
            self.bench.uncertainties.statistical(
                text("harmonics of phase {phase}", phase="ABC"[largest]),
                _PER_CENT * float(thd[largest]),
                _PER_CENT * uncertainty,
            )
            + self.bench.uncertainties.limit(
                "harmonics that a channel's distortion makes", 0.0, _PER_CENT * self._share(THD)
            )
            + self.bench.uncertainties.limit(
                "harmonics that a channel's filter takes", 0.0, _PER_CENT * self._filtered(largest)
            ),
            section=self.section,
            estimator="root of the harmonics' squares over the fundamental, noise taken out",
            misfit=self._misfit.of(THD),
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
        time, values = waves[channels[0]].time, np.vstack([waves[channel].values for channel in channels])
        told = [
            DigitizedChannel(str(c), waves[c].resolution, waves[c].clipped, waves[c].accuracy.gain) for c in channels
        ]
        shape = emf_shape(
            time, values, harmonics=settings.harmonics, resolution=[waves[channel].resolution for channel in channels]
        )
        self._misfits.append(fit_back_emf(time, values, frequency=shape.frequency, digitized=told).misfit)
        return shape

    def _share(self, name: str) -> float:
        """Return what of the fundamental a channel's distortion may take or add, for one of the figures."""
        told = self._misfit.of(name).findings
        widening = [f for f in told if f.answer is Answer.WIDENED and f.figures.get("record") != _TWO_SPEEDS]
        return _BENT * max((float(f.figures.get("share", 0.0)) for f in widening), default=0.0)

    def _filtered(self, phase: int) -> float:
        """Return what filters may have of a phase's distortion that chance does not explain, told or not."""
        if self._lost is None:
            return 0.0
        # The first record has the phases in their order.
        lost, spread = (float(each[phase]) for each in self._lost)
        return _BENT * math.sqrt(max(lost**2 - (_CHANCE * spread) ** 2, 0.0))

    def _tell_lags(self, channels: Sequence[int], forwards: EmfShape, backwards: EmfShape) -> None:
        """Keep by how much the channels are apart in time, and tell a lag that is none of chance."""
        lags = forwards.lags(backwards)
        farthest = int(np.argmax(np.abs(lags)))
        lag = abs(float(lags[farthest]))
        known = math.hypot(forwards.spacing_uncertainty, backwards.spacing_uncertainty)
        if lag > max(_LATE, _BEYOND * known):
            late = 1 if lags[farthest] > 0.0 else 0
            first, second = (channels[(farthest + k) % _PHASES] for k in (1 - late, late))
            self.notice(
                "channel-delay",
                text(
                    "channel {late} shows the EMF {time:.3g} µs ({angle:.2g}° electrical) later than channel {early}: a probe, its filter "
                    "or AC coupling delays one of them. Turning both ways takes this out of the angles",
                    late=second,
                    early=first,
                    time=1e6 * lag / (2.0 * math.pi * forwards.frequency),
                    angle=math.degrees(lag),
                ),
            )


def bent_by(channels: Sequence[int], forwards: EmfShape, backwards: EmfShape) -> Misfit:
    """Return which channel bends the wave the most, where one does."""
    share, uncertainty = forwards.bent(backwards)
    worst = int(np.argmax(share / uncertainty))
    score = float(share[worst] / uncertainty[worst])
    if not (score > _BEYOND and share[worst] > _SEEN_BENT):
        return NO_MISFIT
    figures: dict[str, float | str] = {"record": "emf-both-ways", "channel": str(channels[worst])}
    figures["share"] = float(share[worst])
    return Misfit((Finding(Cause.DISTORTION, Answer.MODELLED, (THD,), score, figures),))


def filtered_by(channels: Sequence[int], lost: FloatArray, spread: FloatArray) -> Misfit:
    """Return which channel's distortion is least like at two speeds, where chance does not explain it."""
    worst = int(np.argmax(np.abs(lost) / spread))
    score, share = float(abs(lost[worst]) / spread[worst]), float(abs(lost[worst]))
    if not (score > _FILTERED and share > _SEEN_FILTERED):
        return NO_MISFIT
    figures: dict[str, float | str] = {"record": _TWO_SPEEDS, "channel": str(channels[worst]), "share": share}
    return Misfit((Finding(Cause.BANDWIDTH, Answer.WIDENED, (THD,), score, figures),))


def of_shape(misfit: Misfit, *, both_ways: bool) -> Misfit:
    """Return what the misfit of fundamentals means for sizes and distortion: a channel that bends the wave shows harmonics of its own, and
    one that lost a part of it another size; that channels differ is what the sizes tell.

    A weak magnet makes harmonics of even order, too: turned `both_ways`, they are told from a channel's.
    """
    found = []
    for finding in misfit.findings:
        record = finding.figures.get("record")
        if finding.cause in _LOST:
            found.append(replace(finding, answer=Answer.WITHHELD, estimates=(UNBALANCE, THD)))
        elif record in ("emf-both-ways", _TWO_SPEEDS):
            found.append(finding)
        elif finding.cause is Cause.UNEXPLAINED:
            # A magnet that is reversed repeats itself every turn and not every period: what no harmonic explains is the motor's as well.
            found.append(replace(finding, answer=Answer.SAID, estimates=(UNBALANCE, THD)))
        elif finding.cause is Cause.BANDWIDTH or (finding.cause is Cause.DISTORTION and (record or not both_ways)):
            found.append(replace(finding, answer=Answer.WIDENED, estimates=(UNBALANCE, THD)))
    return Misfit(tuple(found))
