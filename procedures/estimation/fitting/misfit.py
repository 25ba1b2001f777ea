"""Differences between a record and the fitted model: causes by name, the test that detects them, and the consequences."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: A direction counts as seen beyond so many standard deviations.
ALARM = 3.5


class Cause(StrEnum):
    """The cause of a difference between record and model, as results name it."""

    CLIPPED = "clipped"
    AC_COUPLED = "ac-coupled"
    HUM = "hum"
    BANDWIDTH = "bandwidth"
    SKEW = "skew"
    RINGING = "ringing"
    SATURATION = "saturation"
    SECOND_TIME_CONSTANT = "second-time-constant"
    COMPENSATION = "probe-compensation"
    NO_BASELINE = "no-baseline"
    SWITCHING = "switching"
    PULSE_ENDS = "pulse-ends"
    SLOPE = "slope"
    WINDAGE = "windage"
    STRIBECK = "stribeck"
    FRICTION_DRIFT = "friction-drift"
    SPEED_FILTER = "speed-filter"
    TORQUE_FILTER = "torque-filter"
    TORQUE_ZERO = "torque-zero-drift"
    DROPOUTS = "dropouts"
    REPEATED_ROWS = "repeated-rows"
    COGGING = "cogging"
    VIBRATION = "vibration"
    MODULATED = "modulated"
    ECCENTRICITY = "eccentricity"
    REGRIP = "regrip"
    WRONG_PERIOD = "wrong-period"
    TURNING_POINTS = "turning-points"
    DISTORTION = "distortion"
    PROBE_FACTOR = "probe-factor"
    CHANNELS_DIFFER = "channels-differ"
    WARM_WINDING = "warm-winding"
    CONTACT = "contact"
    REPEATS_DIFFER = "repeats-differ"
    SPEED_TREND = "speed-trend"
    UNEVEN_SPEED = "uneven-speed"
    TOO_COARSE = "too-coarse"
    LOAD_POINT = "load-point"
    SPEED_DIFFERS = "speed-differs"
    UNSETTLED = "unsettled"
    POWER_BALANCE = "power-balance"
    CURVATURE = "curvature"
    ASYMMETRIC_MAP = "asymmetric-map"
    RESIDUAL_VARIANCE = "residual-variance"
    ODD_READING = "odd-reading"
    RESISTANCES_DIFFER = "resistances-differ"
    IRON_LOSS = "iron-loss"
    FRICTION_LEFT = "friction-left"
    MAP_HOLES = "map-holes"
    AXES_SWAPPED = "axes-swapped"
    CURRENTS_OUTWARD = "currents-outward"
    SIGN_REVERSED = "sign-reversed"
    TURNED_180 = "turned-180"
    OTHER_D_AXIS = "other-d-axis"
    MAP_TURNED = "map-turned"
    RESISTANCE_LEFT = "resistance-left"
    TORQUE_COMPUTED = "torque-computed"
    RMS_FOR_PEAK = "rms-for-peak"
    TORQUE_DIFFERS = "torque-differs"
    UNEXPLAINED = "unexplained"


class Answer(StrEnum):
    """The answer to a cause: its term is in the model, the interval includes it, it is only reported, or no figure is given."""

    MODELLED = "modelled"
    WIDENED = "widened"
    SAID = "said"
    WITHHELD = "withheld"


@dataclass(frozen=True)
class Finding:
    """One difference between a record and the plain model.

    `estimates` are the estimates it concerns, all where empty; `score` how far beyond chance it was seen (standard deviations; 0
    where no statistic found it); `figures` are what was found of it by name, in SI, and what it is about, as a channel's name.
    """

    cause: Cause
    answer: Answer
    estimates: tuple[str, ...] = ()
    score: float = 0.0
    figures: Mapping[str, float | str] = field(default_factory=dict)

    def concerns(self, estimate: str) -> bool:
        """Tell whether it concerns an estimate."""
        return not self.estimates or estimate in self.estimates


@dataclass(frozen=True)
class Misfit:
    """All differences between one record and its model, the most serious first; empty if it agrees with the model."""

    findings: tuple[Finding, ...] = ()

    def __bool__(self) -> bool:
        """Tell whether there is any finding."""
        return bool(self.findings)

    def withholding(self, estimate: str) -> Finding | None:
        """Return why an estimate is not given; None where it is."""
        return next((f for f in self.findings if f.answer is Answer.WITHHELD and f.concerns(estimate)), None)

    def of(self, estimate: str, name: str = "") -> "Misfit":
        """Return what concerns an estimate, as said of the parameter `name` that is made of it."""
        return Misfit(tuple(replace(f, estimates=(name or estimate,)) for f in self.findings if f.concerns(estimate)))

    @classmethod
    def together(cls, parts: Iterable["Misfit"]) -> "Misfit":
        """Return the findings of several records, of the same cause, answer and estimates the one seen most clearly."""
        clearest: dict[tuple[Cause, Answer, tuple[str, ...]], Finding] = {}
        for finding in (f for part in parts for f in part.findings):
            key = (finding.cause, finding.answer, finding.estimates)
            if key not in clearest or abs(finding.score) > abs(clearest[key].score):
                clearest[key] = finding
        order = [Answer.WITHHELD, Answer.WIDENED, Answer.MODELLED, Answer.SAID]
        return cls(tuple(sorted(clearest.values(), key=lambda f: order.index(f.answer))))


#: Of a record that is as its model says.
NO_MISFIT = Misfit()


def none_explains(unexplained: Finding, tried: Iterable[Finding], record: str) -> Finding:
    """Return why nothing of a record is given, which terms were `tried` in vain among the figures: causes that were found they are not.

    `record` is what the sentence is about, as "ramp".
    """
    names = ", ".join(dict.fromkeys(finding.cause.value for finding in tried))
    return replace(unexplained, figures={"record": f"{record}-tried", "tried": names} if names else {})


@dataclass(frozen=True)
class Score:
    """The result of a score test of directions (m): `z`, how far beyond chance each is seen; `bias` (m, k), the error of each
    estimate in standard uncertainties for each z of a direction that is not seen.
    """

    z: FloatArray
    bias: FloatArray

    @property
    def alarms(self) -> FloatArray:
        """True for each direction that is seen beyond chance, shape (m,)."""
        return np.asarray(np.abs(self.z) > ALARM)

    def growth(self, modelled: Sequence[int] = (), *, chance: float = 1.0) -> FloatArray:
        """Return by what each estimate's variance grows (k,) for directions that are not in the model, as far as they are seen: by the
        part of z² beyond `chance`.
        """
        left = np.setdiff1d(np.arange(self.z.size), np.asarray(modelled, dtype=int))
        if not left.size:
            return np.ones(self.bias.shape[1])
        seen = np.maximum(0.0, self.z[left] ** 2 - chance)[:, None]
        # What is not seen at all adds nothing, however much it might do.
        bias = np.where(seen > 0.0, self.bias[left], 0.0)
        return np.asarray(1.0 + np.max(bias**2 * seen, axis=0))


def score_test(
    residuals: FloatArray,
    slopes: FloatArray,
    directions: FloatArray,
    variance: FloatArray | float | Callable[[FloatArray], FloatArray] = 1.0,
) -> Score:
    """Test whitened residuals (n,) of a fit for directions (m, n) = ∂model/∂cause that its model does not hold.

    `slopes` (k, n) are ∂model/∂estimate. All are whitened and include the rows of prior knowledge, without which a free delay hides a
    curvature. `variance` (m,) or one is that of a unit direction's component, 1 and what noise that is not white adds; or what gives it for
    the unit directions (m, n) across the slopes.
    Source: Rao's score test; Breusch and Godfrey for regressions.
    """
    normal = slopes @ slopes.T
    scale = np.sqrt(np.diag(normal))
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), hermitian=True) / np.outer(scale, scale)
    shift = directions @ slopes.T @ inverse
    across = directions - shift @ slopes
    length = np.sqrt(np.einsum("mn,mn->m", across, across))
    # A direction that the estimates make up for all but wholly cannot be seen at all.
    total = np.sqrt(np.einsum("mn,mn->m", directions, directions))
    told = length > 1e-6 * np.maximum(total, 1e-300)
    safe = np.where(told, length, 1.0)
    given = variance(across / safe[:, None]) if callable(variance) else np.asarray(variance, dtype=np.float64)
    spread = np.sqrt(np.broadcast_to(given, length.shape))
    z = np.where(told, across @ residuals / (safe * spread), 0.0)
    uncertainty = np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    bias = np.where(told[:, None], np.abs(shift) * spread[:, None] / (safe[:, None] * uncertainty), np.inf)
    return Score(np.asarray(z), np.asarray(bias))
