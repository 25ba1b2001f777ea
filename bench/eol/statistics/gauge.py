"""Gauge repeatability and reproducibility: crossed study by analysis of variance."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class GaugeStudy:
    """Standard deviations in the figure's unit, and what share of the whole each is.

    `pooled` tells that the interaction of part and appraiser was not significant at `alpha` and went into repeatability.
    `grr_interval` holds the true R&R with the confidence asked for. `categories` is the number of distinct categories.
    """

    repeatability: float
    reproducibility: float
    interaction: float
    grr: float
    parts: float
    total: float
    grr_share: float
    grr_interval: tuple[float, float]
    categories: int
    interaction_p: float
    pooled: bool
    alpha: float


def gauge_study(values: ArrayLike, *, alpha: float = 0.05, confidence: float = 0.95) -> GaugeStudy:
    """Return the study of `values`, shape (appraisers, parts, trials): at least two of each.

    Interaction is pooled into repeatability where its p is above `alpha` (AIAG, Measurement Systems Analysis, 4th ed., III B;
    negative variances count as none). `grr_share` is R&R over total variation.
    The interval of R&R is the modified large-sample one (Burdick, Borror, Montgomery, 2005).
    Raises ValueError for another shape or figures that are none.
    """
    # scipy.stats takes a second to load, and these are the same functions.
    from scipy.special import chdtri, fdtrc

    data = np.asarray(values, dtype=np.float64)
    if data.ndim != 3 or min(data.shape) < 2:
        raise ValueError(f"a crossed study needs appraisers × parts × trials, at least 2 of each, not {data.shape}")
    if not np.isfinite(data).all():
        raise ValueError("the study has figures that are missing or no numbers")
    appraisers, parts, trials = data.shape
    whole = data.mean()
    by_part, by_appraiser, cells = data.mean(axis=(0, 2)), data.mean(axis=(1, 2)), data.mean(axis=2)
    ss_parts = appraisers * trials * float(((by_part - whole) ** 2).sum())
    ss_appraisers = parts * trials * float(((by_appraiser - whole) ** 2).sum())
    ss_both = trials * float(((cells - by_part[None, :] - by_appraiser[:, None] + whole) ** 2).sum())
    ss_error = float(((data - cells[:, :, None]) ** 2).sum())
    df_parts, df_appraisers = parts - 1, appraisers - 1
    df_both, df_error = df_parts * df_appraisers, appraisers * parts * (trials - 1)
    ms_both, ms_error = ss_both / df_both, ss_error / df_error
    p = float(fdtrc(df_both, df_error, ms_both / ms_error)) if ms_error > 0.0 else 0.0
    pooled = p > alpha
    if pooled:
        df_error += df_both
        ms_error = (ss_error + ss_both) / df_error
        ms_below, both = ms_error, 0.0
    else:
        ms_below, both = ms_both, max(0.0, (ms_both - ms_error) / trials)
    ms_appraisers, ms_parts = ss_appraisers / df_appraisers, ss_parts / df_parts
    appraiser = max(0.0, (ms_appraisers - ms_below) / (parts * trials))
    part = max(0.0, (ms_parts - ms_below) / (appraisers * trials))
    grr = ms_error + appraiser + both
    total = grr + part
    # R&R as a sum of mean squares: what the interval is made of.
    terms = [(1.0 / (parts * trials), ms_appraisers, df_appraisers)]
    if pooled:
        terms.append((1.0 - 1.0 / (parts * trials), ms_error, df_error))
    else:
        terms += [((parts - 1.0) / (parts * trials), ms_both, df_both), ((trials - 1.0) / trials, ms_error, df_error)]
    tail = (1.0 - confidence) / 2.0
    below = math.hypot(*(c * m * (1.0 - d / float(chdtri(d, tail))) for c, m, d in terms))
    above = math.hypot(*(c * m * (d / float(chdtri(d, 1.0 - tail)) - 1.0) for c, m, d in terms))
    middle = sum(c * m for c, m, _ in terms)
    spread = math.sqrt(grr)
    whole_spread = math.sqrt(total)
    return GaugeStudy(
        repeatability=math.sqrt(ms_error),
        reproducibility=math.sqrt(appraiser + both),
        interaction=math.sqrt(both),
        grr=spread,
        parts=math.sqrt(part),
        total=whole_spread,
        grr_share=spread / whole_spread if total > 0.0 else math.nan,
        grr_interval=(math.sqrt(max(0.0, middle - below)), math.sqrt(middle + above)),
        categories=int(math.sqrt(2.0) * math.sqrt(part) / spread) if spread > 0.0 else 0,
        interaction_p=p,
        pooled=pooled,
        alpha=alpha,
    )
