"""Torque captures of a slowly turned shaft: the cogging torque."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis.applied import AppliedAccuracy
from bench.analysis.outcome import (
    AnalysisOutcome,
    estimated,
    open_unit,
    paths_of,
    pick,
    refuse_copies,
    refuse_over_range,
)
from bench.analysis.shaft_columns import SPEED_WORDS, SpeedColumn, is_electrical, is_torque, torque_in_units
from bench.analysis.statements import Statement
from bench.captures import WHOLE, Capture, CaptureChannel, CaptureError, CapturePart, read_capture
from bench.captures.written_digits import FloatArray
from drivers.interfaces.text import Text, Translate, english, text
from procedures.estimation.fitting.misfit import Misfit
from procedures.estimation.mechanics.cogging import Cogging, fit_cogging
from procedures.estimation.mechanics.cogging_speeds import AtHalfSpeed, compare, read_again
from procedures.techniques.shaft.cogging_figure import TransducerFilter, cogging_figure

_ANGLE_WORDS = ("angle", "theta", "winkel", "position")
_RPM = math.pi / 30.0
#: Orders below this are no cogging where the pole pairs are not known: each pole passes a slot twice a turn at least.
_LOWEST = 6
#: A second record is compared with the first at half of its speed, which need not be exact.
_HALF, _NEAR = 0.5, 0.03
#: Readings of an angle this far (rad) back are noise of an encoder, and more is another way of turning.
_BACK = 0.05


@dataclass(frozen=True)
class _Record:
    """Torque (N·m) over the shaft's angle (rad), with the times (s) where the file has them, the mean speed (rad/s), 0 at rest, and what
    was assumed of a column of speed.
    """

    capture: Capture
    angle: FloatArray
    torque: CaptureChannel
    speed: float
    assumed: Sequence[Text] = ()


def analyze_cogging(
    file: str | Path | Sequence[str | Path],
    *,
    order: int | None = None,
    pole_pairs: int | None = None,
    speed_rpm: float | None = None,
    averaging: float = 0.02,
    torque_filter: float = 0.0,
    accuracy: Sequence[Statement] = (),
    selection: CapturePart = WHOLE,
    translate: Translate = english,
) -> dict[str, Any]:
    """Return the peak-to-peak torque that an open motor repeats every turn, from torque over the shaft's angle, or over time.

    Over time the angle is a column, or follows from a column of speed or from `speed_rpm`. A second file is a record at half the speed of
    the first: it shows filters and vibrations. `order` is the number of periods a turn, where it is known; `pole_pairs` tell the lowest
    order that is cogging. The transducer averages over `averaging` (s) at most, or has a first-order `torque_filter` (s). `accuracy` states
    the errors of torque. `translate` gives sentences in the reader's language. Raises CaptureError naming file and line.
    """
    captures = [read_capture(path, abscissa="angle", selection=selection) for path in paths_of(file)]
    if not 1 <= len(captures) <= 2:
        raise CaptureError(
            ", ".join(capture.source for capture in captures) or "capture",
            text("{count} files: give one, or a second one at half the speed of the first", count=len(captures)),
        )
    records = [_record(capture, speed_rpm, pole_pairs, again=bool(k)) for k, capture in enumerate(captures)]
    refuse_copies([(record.capture.source, record.torque.values) for record in records])
    first = records[0]
    applied = AppliedAccuracy(accuracy, {"torque": tuple(dict.fromkeys(r.torque.name for r in records))}, captures)
    outcome = AnalysisOutcome("cogging_torque", "L5", first.capture, applied, translate)
    fit = estimated(
        first.capture,
        lambda: fit_cogging(
            first.angle,
            first.torque.values,
            time=first.capture.time,
            order=order,
            lowest_order=max(2 * pole_pairs, 2) if pole_pairs else _LOWEST,
            resolution=first.torque.resolution,
            torque_filter=torque_filter,
        ),
    )
    transducer = TransducerFilter(averaging if first.speed else 0.0, torque_filter)
    slower = _at_half_speed(records, fit, transducer) if len(records) > 1 else AtHalfSpeed()
    turns = abs(float(first.angle[-1] - first.angle[0])) / (2.0 * math.pi)
    highest = 0.5 * first.angle.size / turns
    size, notices = cogging_figure(
        outcome.uncertainties, fit, slower, transducer, first.speed, highest, order_given=order is not None
    )
    outcome.assume(*first.assumed, *_assumed(first, len(records), averaging, torque_filter, order, pole_pairs))
    for name, said in notices:
        outcome.warn(said, name)
    outcome.parameter(
        "cogging_torque",
        outcome.with_errors(size, "torque", first.torque.name, gain=1.0),
        estimator="orders that stand out of the noise, from trough to crest",
        misfit=Misfit.together((fit.misfit, slower.misfit)).of("cogging_torque"),
    )
    outcome.detail(
        orders=fit.orders.tolist(),
        amplitudes=fit.amplitudes.tolist(),
        drag=fit.mean,
        noise=fit.noise,
        turned=turns,
        speed=first.speed,
    )
    return outcome.as_dict()


def _record(capture: Capture, speed_rpm: float | None, pole_pairs: int | None, *, again: bool) -> _Record:
    """Return a record's torque over the angle; `again` is one at half of the speed that was typed."""
    torques = [refuse_over_range(capture, torque_in_units(capture, c)) for c in capture.channels if is_torque(c)]
    if len(torques) != 1:
        raise CaptureError(
            capture.source,
            text(
                "{count} columns are a torque: one is needed, named torque or in Nm or mNm. The columns are {names}",
                count=len(torques),
                names=[channel.name for channel in capture.channels],
            ),
        )
    rest = [channel for channel in capture.channels if channel.name != torques[0].name]
    angle = _angle(capture, rest)
    typed = None if speed_rpm is None else speed_rpm * _RPM * (_HALF if again else 1.0)
    if angle is None:
        speed, assumed = (
            (np.full(torques[0].values.size, typed), []) if typed is not None else _speeds(capture, rest, pole_pairs)
        )
        times = capture.times()
        steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(times)
        angle = np.concatenate(([0.0], np.cumsum(steps)))
        return _Record(capture, angle, torques[0], abs(float(np.mean(speed))), assumed)
    turned = abs(float(angle[-1] - angle[0]))
    if capture.time is not None:
        return _Record(capture, angle, torques[0], turned / float(np.ptp(capture.time)))
    return _Record(capture, angle, torques[0], abs(typed or 0.0))


def _angle(capture: Capture, among: Sequence[CaptureChannel]) -> FloatArray | None:
    """Return the angles (rad) as they go on over a turn's end, None where no column is one."""
    found = next(
        (c for c in among if c.unit == "rad" or (not c.unit and any(word in c.name.lower() for word in _ANGLE_WORDS))),
        None,
    )
    if found is None:
        return None
    if not found.unit:
        raise open_unit(capture, found.name, "angle", ("deg", "rad"))
    angle = np.unwrap(found.values)
    way = math.copysign(1.0, float(angle[-1] - angle[0]))
    back = np.maximum.accumulate(way * angle) - way * angle
    if np.max(back) > _BACK:
        raise CaptureError(
            capture.source,
            text(
                "the angle '{name}' turns back by {back:.2g}°: select a part that turns one way (--from, --to)",
                name=found.name,
                back=math.degrees(float(np.max(back))),
            ),
            capture.line_of(int(np.argmax(back))),
        )
    return np.asarray(angle)


def _speeds(
    capture: Capture, among: Sequence[CaptureChannel], pole_pairs: int | None
) -> tuple[FloatArray, Sequence[Text]]:
    """Return the shaft's speeds (rad/s), and what had to be assumed. Raises CaptureError where nothing tells the angle."""
    if not among:
        raise CaptureError(
            capture.source,
            text("nothing tells the angle of the torques: add a column of angle or speed, or type --speed-rpm"),
        )
    column = pick(replace(capture, channels=tuple(among)), None, ("rad/s",), "speed", SPEED_WORDS)
    if not column.unit:
        raise open_unit(capture, column.name, "speed", ("rpm", "rad/s"))
    speed = SpeedColumn(pole_pairs=pole_pairs if is_electrical(column.name) else None)
    channel, assumed = speed.of_shaft(capture, [column])
    return channel.values, assumed


def _at_half_speed(records: Sequence[_Record], fit: Cogging, transducer: TransducerFilter) -> AtHalfSpeed:
    """Return what the second record tells. Raises CaptureError where it is not one at half the speed."""
    first, second = records
    if not first.speed or abs(second.speed / first.speed - _HALF) > _NEAR:
        raise CaptureError(
            second.capture.source,
            text(
                "the second record is to be one at half the speed of the first: {second:.4g} rpm, but the first has {first:.4g} rpm",
                second=second.speed / _RPM,
                first=first.speed / _RPM,
            ),
        )
    if not fit.orders.size:
        return AtHalfSpeed()
    return estimated(
        second.capture,
        lambda: compare(
            (first.angle, first.torque.values),
            (second.angle, second.torque.values),
            read_again(fit.orders, fit.amplitudes),
            fit,
            first.speed,
            transducer.averaging,
            transducer.torque_filter,
        ),
    )


def _assumed(
    first: _Record, records: int, averaging: float, torque_filter: float, order: int | None, pole_pairs: int | None
) -> list[Text]:
    """Return what the files left open."""
    said = [text("terminals open, shaft turned evenly one way; the mean torque is drag and is left out")]
    if not first.speed:
        said.append(text("torques read at rest, angle by angle; type --speed-rpm if the shaft turned"))
    elif not torque_filter:
        said.append(
            text(
                "the transducer averages over {averaging:g} s at most, otherwise state --averaging or --torque-filter",
                averaging=averaging,
            )
        )
        if records == 1:
            said.append(
                text(
                    "a slower filter and a vibration of the stand are not seen at one speed: add a record at half the speed"
                )
            )
    if order is None and pole_pairs is None:
        said.append(
            text(
                "orders from {lowest} a turn on are cogging, lower ones run-out of the coupling; state --pole-pairs, or --order",
                lowest=_LOWEST,
            )
        )
    return said
