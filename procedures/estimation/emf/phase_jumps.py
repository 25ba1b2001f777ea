"""Detects samples that are missing although the time column has no gap: the phase of the waveform jumps in all channels at once."""

from dataclasses import dataclass, replace

import numpy as np

from procedures.estimation.emf.harmonics import HarmonicModel, by_phase
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit

#: A jump is seen beyond so many standard deviations, and matters beyond this angle (rad): less takes 10⁻⁴ of an amplitude away.
_SEEN, _LEAST_ANGLE = 8.0, 0.03
#: Of what the phase does beyond a smooth course, one jump explains this share at least; a ripple of the speed none.
_EXPLAINS = 0.35
#: By how much of χ² a jump must be the better explanation than a smooth course of a higher degree.
_BETTER = 12.0
#: So much of a record on either side of a jump is left out with it: where it lies is known so well.
_BESIDE = 0.01
#: Less than this of a period is no record.
_LEAST_PERIODS = 1.05


@dataclass(frozen=True)
class _Smooth:
    """Criterion of a smooth course: a polynomial of `degree`, or one of degree `rival` where that explains it better than a jump;
    means over so many `stretches` show what there is to explain.
    """

    degree: int
    rival: int
    stretches: int


#: Over a whole record, and over a few periods beside a jump, where others do not reach.
_WHOLE, _NEAR, _NEAR_PERIODS = _Smooth(3, 9, 48), _Smooth(2, 5, 16), 1.25


def find_jump(t: FloatArray, orders: tuple[int, ...], model: HarmonicModel) -> int | None:
    """Return the sample from which the phase has jumped, the most clearly seen one; None where it does not."""
    slopes = by_phase(model, orders, t)
    weights = 1.0 / np.maximum(np.mean(model.residuals**2, axis=1), 1e-300)
    seen = np.einsum("c,cn,cn->n", weights, slopes, model.residuals)
    told = np.einsum("c,cn,cn->n", weights, slopes, slopes)
    at, found = _jump(seen, told, _WHOLE)
    if found or at is None:
        return at
    reach = max(32, round(_NEAR_PERIODS * t.size * np.pi / float(model.course[1])))
    first, last = max(at - reach, 0), min(at + reach, t.size)
    near, found = _jump(seen[first:last], told[first:last], _NEAR)
    return first + near if found and near is not None else None


def _jump(seen: FloatArray, told: FloatArray, smooth: _Smooth) -> tuple[int | None, bool]:
    """Return where the phase jumps most clearly, None where no jump would matter, and whether it is one: by what is `seen` (n,) of the
    phase, and how well each sample tells it (n,).
    """
    size = seen.size
    polynomials = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, size), smooth.rival).T
    basis = polynomials[: smooth.degree + 1]
    weighted = basis * told
    inverse = np.linalg.pinv(weighted @ basis.T, hermitian=True)
    start = basis @ seen
    # Sums over all samples from one on.
    later_seen, later_told = np.cumsum(seen[::-1])[::-1], np.cumsum(told[::-1])[::-1]
    later_basis = np.cumsum(weighted[:, ::-1], axis=1)[:, ::-1]
    across = later_seen - later_basis.T @ (inverse @ start)
    length = later_told - np.einsum("kn,kl,ln->n", later_basis, inverse, later_basis)
    margin = max(4, round(_BESIDE * size))
    inner = slice(margin, size - margin)
    usable = length[inner] > 1e-3 * float(np.sum(told))
    power = np.where(usable, across[inner] ** 2 / np.maximum(length[inner], 1e-300), 0.0)
    at = int(np.argmax(power)) + margin
    angle, jump = across[at] / max(float(length[at]), 1e-300), float(power[at - margin])
    if jump < _SEEN**2 or abs(angle) < _LEAST_ANGLE:
        return None, False
    higher = np.linalg.pinv((polynomials * told) @ polynomials.T, hermitian=True)
    rival = float((polynomials @ seen) @ higher @ (polynomials @ seen) - start @ inverse @ start)
    edges = np.linspace(0, size, smooth.stretches + 1).astype(int)[:-1]
    left = seen - told * (inverse @ start @ basis)
    stretches = float(np.sum(np.add.reduceat(left, edges) ** 2 / np.maximum(np.add.reduceat(told, edges), 1e-300)))
    return at, jump > rival + _BETTER and jump > _EXPLAINS * (stretches - smooth.stretches)


def longest_whole(t: FloatArray, jump: int, frequency: float, misfit: Misfit) -> tuple[slice | None, Misfit]:
    """Return the longer part of a record beside its jump, without what is close to it, None where it holds less than a period of
    `frequency` (Hz), and what is told of the record, whose other findings are `misfit`.
    """
    margin = max(2, round(_BESIDE * t.size))
    before, after = slice(0, max(jump - margin, 0)), slice(min(jump + margin, t.size), t.size)
    part = before if before.stop >= t.size - after.start else after
    size = part.stop - part.start
    whole = size >= 32 and float(t[part][-1] - t[part][0]) * frequency >= _LEAST_PERIODS
    figures: dict[str, float | str] = {"record": "emf-jumps", "count": 1.0, "used": size / t.size}
    answer = Answer.MODELLED if whole else Answer.WITHHELD
    finding = Finding(Cause.DROPOUTS, answer, ("flux_linkage",), _SEEN, figures)
    return (part if whole else None), (Misfit((finding,)) if whole else Misfit((finding, *misfit.findings)))


def with_jump(misfit: Misfit, found: Misfit) -> Misfit:
    """Return the findings of a record's part together with the jump at which it was divided; jumps are counted together."""
    (jump,) = found.findings
    others = []
    for each in misfit.findings:
        if each.figures.get("record") == "emf-jumps":
            both = {
                **jump.figures,
                "count": float(jump.figures["count"]) + float(each.figures["count"]),
                "used": float(jump.figures["used"]) * float(each.figures["used"]),
            }
            jump = replace(jump, answer=each.answer, figures=both)
        else:
            others.append(each)
    return Misfit((jump, *others))
