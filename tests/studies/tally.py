"""Sums over motors, in memory that does not grow with their number, and the table they make."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from tests.studies.worlds.measured_motor import Figure, Measured

#: Figures that are whole numbers and right or wrong.
COUNTS = frozenset({"pole_pairs"})
#: |z| is counted in so many bins of this width, and one for all beyond: memory does not grow with the number of motors.
_BINS, _BIN = 1000, 0.01
_COVERAGE = 0.95


@dataclass
class Row:
    """Sums over one procedure's figures of one parameter; z is error over stated standard uncertainty."""

    number: int = 0
    covered: int = 0
    z: float = 0.0
    z_squared: float = 0.0
    factors: float = 0.0
    relative_error: float = 0.0
    relative_width: float = 0.0
    largest: float = 0.0
    largest_index: int = -1
    sizes: list[int] = field(default_factory=lambda: [0] * (_BINS + 1))

    def add(self, figure: Figure, index: int) -> None:
        """Take one motor's figure into account."""
        self.number += 1
        # A whole number has no width; what rounding leaves of it does not count.
        slack = 1e-9 * abs(figure.truth)
        self.covered += figure.low - slack <= figure.truth <= figure.high + slack
        error = figure.value - figure.truth
        self.relative_error += error / figure.truth
        self.relative_width += 0.5 * (figure.high - figure.low) / abs(figure.truth)
        if figure.uncertainty > 0.0:
            z = error / figure.uncertainty
            self.z += z
            self.z_squared += z * z
            self.factors += 0.5 * (figure.high - figure.low) / figure.uncertainty
            self.sizes[min(int(abs(z) / _BIN), _BINS)] += 1
            if abs(z) > self.largest:
                self.largest, self.largest_index = abs(z), index

    @property
    def coverage(self) -> float:
        """Share of the 95 % intervals that hold the truth."""
        return self.covered / self.number

    @property
    def bias(self) -> float:
        """Mean error in stated standard uncertainties."""
        return self.z / self.number

    @property
    def spread(self) -> float:
        """Root mean square of z: 1 where the stated uncertainties are the true ones."""
        return math.sqrt(self.z_squared / self.number)

    @property
    def ideal(self) -> float:
        """Half-width, in stated uncertainties, of the shortest interval that would have held 95 % of the truths."""
        wanted, held = _COVERAGE * sum(self.sizes), 0
        for place, number in enumerate(self.sizes):
            if held + number >= wanted and number:
                return _BIN * (place + (wanted - held) / number)
            held += number
        return 0.0

    @property
    def width(self) -> float:
        """Mean half-width over that of the ideal interval, both in stated uncertainties."""
        return self.factors / self.number / self.ideal if self.ideal else 1.0


@dataclass
class Tally:
    """All rows of a study, and its refusals and failures with their counts."""

    motors: int = 0
    rows: dict[tuple[str, str], Row] = field(default_factory=dict)
    refused: Counter[tuple[str, str]] = field(default_factory=Counter)
    failed: Counter[tuple[str, str]] = field(default_factory=Counter)

    def add(self, measured: Measured) -> None:
        """Take one motor into account; motors must come in the order of their index, so that sums are the same."""
        self.motors += 1
        for figure in measured.figures:
            self.rows.setdefault((figure.name, figure.procedure), Row()).add(figure, measured.index)
        self.refused.update(measured.refused)
        self.failed.update(measured.failed)


def lines(tally: Tally) -> Iterable[str]:
    """Give the table as Markdown, then refusals and failures."""
    yield "| parameter | procedure | motors | coverage | width / ideal | bias / u | rms / u | mean U | largest error / u |"
    yield "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    for (name, procedure), row in sorted(tally.rows.items()):
        if name in COUNTS:
            yield f"| {name} | {procedure} | {row.number} | {row.coverage:.1%} | – | – | – | – | – |"
            continue
        yield (
            f"| {name} | {procedure} | {row.number} | {row.coverage:.1%} | {row.width:.2f} | {row.bias:+.2f} | "
            f"{row.spread:.2f} | {row.relative_width / row.number:.2%} | {row.largest:.1f} (motor {row.largest_index}) |"
        )
    yield ""
    yield f"Failures: {sum(tally.failed.values())}. Refusals: {sum(tally.refused.values())}, by reason:"
    yield ""
    for kind, counted in (("failed", tally.failed), ("refused", tally.refused)):
        for (procedure, reason), number in sorted(counted.items(), key=lambda item: (-item[1], item[0])):
            yield f"- {number} × {procedure} {kind}: {reason}"
