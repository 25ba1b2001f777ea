"""Two channels in opposite phase: probes on the two ends of one line without a ground on the motor, or one line read in both directions."""

from collections.abc import Sequence

import numpy as np

from bench.analysis.back_emf_record import BackEmfRecord
from bench.analysis.outcome import AnalysisOutcome
from drivers.interfaces.text import text

#: Two channels this near to half a period apart (cosine, 12°) are no two voltages of three phases: those are 30° or more from it.
_OPPOSITE = -0.978
#: Isolated probes that read one line in both directions agree better than this.
_ALIKE = 0.05


def judge_opposite(
    outcome: AnalysisOutcome, records: Sequence[BackEmfRecord], withheld: Sequence[str], *, typed: bool
) -> None:
    """Give none of `withheld` where a record's two channels are in opposite phase: what hangs on their grounds is a factor of 2.

    Somebody who `typed` where the probes were is believed as far as the two are equal.
    """
    for record in records:
        if len(record.names) != 2 or np.cos(record.fit.phases[1] - record.fit.phases[0]) > _OPPOSITE:
            continue
        sizes = np.abs(record.fit.amplitudes[:, record.fit.harmonics.index(1)])
        apart = float(2.0 * np.ptp(sizes) / np.sum(sizes))
        if typed and apart < _ALIKE:
            continue
        outcome.withhold(
            withheld,
            "opposite-channels",
            text(
                "channels {first} and {second} are in opposite phase, and their sizes differ by {apart:.1%}: no two voltages of a "
                "motor's lines or phases are. Where the probes' joined grounds are not on the motor, two probes on two terminals show "
                "this: each has a part of one line's voltage, which is the difference of the two. Type --connection ends if that is so. "
                "If isolated probes read one line in both directions, type --connection line with channels that agree. The flux linkage "
                "differs by 2",
                first=record.names[0],
                second=record.names[1],
                apart=apart,
            ),
        )
        return
