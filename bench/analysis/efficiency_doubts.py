"""Signs that a table of load points was not measured as stated: another unit, exchanged columns, a computed power."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from drivers.interfaces.text import Text, text

#: From rpm to rad/s: what a speed in rad/s under a heading in rpm is too small by.
_RPM = 30.0 / math.pi
#: Motors under load are not below this efficiency at every point.
_LOW = 0.105
#: So near to one at every point, the output was taken from the input, or the other way round: rounding to four digits.
_SAME = 5e-4
#: Torques (N·m) and speeds (rad/s) that belong together in no test of a motor, unless the columns are exchanged.
_LARGE_TORQUE, _SLOW = 50.0, 0.5
#: A row's loss is odd where it is off what the others make of it by so many times their median, and by this share of the power; so many
#: rows tell it.
_ODD, _ODD_SHARE, _LEAST_ROWS = 10.0, 0.3, 8


def doubts(
    points: Sequence[tuple[float, float, float]], without: Sequence[tuple[float, float, float]] = ()
) -> Iterator[tuple[str, Text]]:
    """Give the id and the words of each doubt about load points of torque (N·m), speed (rad/s) and electrical power (W) with an
    efficiency, and `without` one.
    """
    if not points:
        return
    above = sum(1 for torque, speed, power in without if torque * speed > power > 0.0 or torque * speed < power < 0.0)
    if above:
        yield (
            "above-one",
            text(
                "{count} rows give out more power than they take in. Unless these rows are written wrong, an error of the torque's zero, "
                "of a gain or of the power meter makes them so, and it is in all other rows too: their efficiencies are too high, and "
                "their intervals do not include it. Correct the rows, or find the error and state it with --torque-zero, --torque-gain or "
                "--power-gain",
                count=above,
            ),
        )
    if odd := _odd_rows(points):
        yield (
            "odd-row",
            text(
                "the losses of rows {rows} do not follow from the other rows, by more than {share:.0%} of the power: a digit, a decimal "
                "mark or a range may be wrong there. Read them again",
                rows=[f"{torque:.4g} N·m, {speed:.4g} rad/s" for torque, speed, _ in odd],
                share=_ODD_SHARE,
            ),
        )
    ratios = [torque * speed / power for torque, speed, power in points]
    efficiencies = [ratio if power > 0.0 else 1.0 / ratio for ratio, (_, _, power) in zip(ratios, points, strict=True)]
    if all(abs(ratio - 1.0) < _SAME for ratio in ratios):
        yield (
            "power-computed",
            text(
                "input and output power are equal at every point. Either one was computed from the other, or the "
                "power is shaft power; the result is no measured efficiency. Give the electrical power into the "
                "terminals"
            ),
        )
    if all(efficiency < _LOW for efficiency in efficiencies):
        yield (
            "low-efficiency",
            text(
                "the efficiency is {most:.3g} % at most, less than any usual motor has under load. A speed in "
                "rad/s under a heading in rpm makes it 9.549 times too small; corrected, it would be {low:.3g} "
                "to {high:.3g} %. Check the units of speed, torque and power",
                most=100.0 * max(efficiencies),
                low=100.0 * _RPM * min(efficiencies),
                high=100.0 * _RPM * max(efficiencies),
            ),
        )
    torque, speed = (max(abs(point[k]) for point in points) for k in (0, 1))
    if torque > _LARGE_TORQUE and speed < _SLOW:
        yield (
            "columns-exchanged",
            text(
                "{torque:.4g} N·m at {speed:.3g} rad/s: are the columns of torque and speed interchanged? Their "
                "product, and so the efficiency, does not show it. State the columns with --column",
                torque=torque,
                speed=speed,
            ),
        )


def _odd_rows(points: Sequence[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """Return the points whose loss is far from what the others make of it: constant, by speed and its square, by torque's square."""
    left, odd = list(points), []
    while len(left) >= _LEAST_ROWS:
        torque, speed, power = np.array(left).T
        rows = np.column_stack((np.ones(torque.size), np.abs(speed), speed**2, torque**2))
        basis = np.linalg.svd(rows / np.max(rows, axis=0), full_matrices=False)
        axes = basis[0][:, basis[1] > 1e-9 * basis[1][0]]
        loss = power - torque * speed
        apart = np.abs(loss - axes @ (axes.T @ loss)) / np.maximum(1.0 - np.sum(axes**2, axis=1), 1e-9)
        worst = int(np.argmax(apart))
        others, lost = np.delete(rows, worst, axis=0), np.delete(loss, worst)
        solution = np.linalg.lstsq(others, lost, rcond=None)[0]
        expected, spread = float(rows[worst] @ solution), float(np.median(np.abs(lost - others @ solution)))
        off = abs(float(loss[worst]) - expected)
        if off <= max(_ODD * spread, _ODD_SHARE * abs(float(power[worst]))):
            break
        odd.append(left.pop(worst))
    return odd
