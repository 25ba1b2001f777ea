"""The figure of a cogging torque and its uncertainty, from what one or two speeds show."""

import math
from dataclasses import dataclass

import numpy as np
from GTC.lib import UncertainReal

from drivers.interfaces.text import Text, text
from procedures.core.budget import Uncertainties
from procedures.estimation.mechanics.cogging import Cogging
from procedures.estimation.mechanics.cogging_speeds import AtHalfSpeed

#: A share of the torque that the transducer's averaging may take away before it is worth a warning.
_BLURRED = 0.1
#: Periods within the averaging beyond which nothing reliable is left.
_NULL = 0.9
#: The share of a limit that its 95 % interval reaches.
_OF_LIMIT = 0.95
#: How many standard uncertainties of the scatter lie beyond the end of a limit where the truth is usual.
_SCATTER_BEYOND = 1.25


@dataclass(frozen=True)
class TransducerFilter:
    """What a torque transducer does to a wave: it averages over `averaging` (s) at most, or has a first-order `torque_filter` (s) that is
    stated.
    """

    averaging: float
    torque_filter: float = 0.0

    def passed(self, order: float, speed: float) -> float:
        """Return the share of an order that the averaging lets through at a speed (rad/s)."""
        return float(np.sinc(min(order * speed * self.averaging / (2.0 * math.pi), _NULL)))


def cogging_figure(
    uncertainties: Uncertainties,
    fit: Cogging,
    slower: AtHalfSpeed,
    transducer: TransducerFilter,
    speed: float,
    highest: float,
    *,
    order_given: bool,
) -> tuple[UncertainReal, tuple[tuple[str, Text], ...]]:
    """Return the peak-to-peak torque (N·m) that was read at a `speed` (rad/s), and notices by their names.

    `highest` is the highest order that the readings follow.
    """
    notices: list[tuple[str, Text]] = []
    if fit.peak_to_peak > 0.0:
        size = uncertainties.statistical("scatter of the torque over a turn", fit.peak_to_peak, fit.uncertainty)
        high, multiples = text("orders too high to be seen"), text("multiples within the scatter")
        size = size + uncertainties.limit(multiples if order_given else high, 0.0, fit.hidden)
        if fit.above:
            size = size + uncertainties.limit("another order besides the one given", *_up_to(fit.above))
    else:
        # Anything up to this would have drowned.
        notices.append(
            (
                "none-seen",
                text(
                    "no cogging stands out of the scatter: the figure is a bound, for a transducer that averages over {time:g} s at most. "
                    "Where it has a slower filter, state the filter or turn more slowly",
                    time=transducer.torque_filter or transducer.averaging,
                ),
            )
        )
        # Averaging takes most of the highest order that the readings follow. The 95 % interval begins at none.
        hidden = fit.hidden / transducer.passed(highest, speed)
        size = uncertainties.limit("cogging that the scatter may hide", *_up_to(hidden))
    # A filter that is stated is undone, and one that half the speed shows is made up for.
    if fit.orders.size and not (transducer.torque_filter or slower.limit):
        order = float(fit.orders[int(np.argmax(fit.amplitudes))])
        seen = transducer.passed(order, speed)
        lost = 1.0 - seen
        if lost > _BLURRED:
            notices.append(
                (
                    "blurred",
                    text(
                        "at this speed the transducer's averaging over {time:g} s may reduce a torque of {order:.0f} "
                        "periods per turn by {lost:.0%}; turn more slowly",
                        time=transducer.averaging,
                        lost=lost,
                        order=order,
                    ),
                )
            )
        # Most transducers are faster than the limit: the figure without any averaging, and its scatter, are well inside.
        scatter = fit.uncertainty / fit.peak_to_peak if fit.peak_to_peak > 0.0 else 0.0
        more, half = _up_to(lost / seen)
        half += _SCATTER_BEYOND * min(scatter, 0.5 * more)
        size = size * (1.0 + uncertainties.limit("averaging in the transducer", more, half))
    if slower.limit:
        size = size * uncertainties.limit("filter of the torque, by half the speed", slower.factor, slower.limit)
    if slower.more:
        size = size + uncertainties.limit("a wave that half the speed alone shows", *_up_to(slower.more))
    return size, tuple(notices)


def _up_to(most: float) -> tuple[float, float]:
    """Return middle and half-width of what is between none and `most`, such that the 95 % interval reaches both ends."""
    return 0.5 * most, 0.5 * most / _OF_LIMIT
