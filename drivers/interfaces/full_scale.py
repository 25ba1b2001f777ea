"""A limit of error that a data sheet states as a share of full scale, as an error of gain of one trace."""

#: How a limit of full scale is read, for a budget's rows.
FULL_SCALE_READING = "a difference of any two points on the screen has at most this error"


def gain_of_full_scale(share: float, full_scale: float, low: float, high: float) -> float:
    """Return the largest relative error of gain of a trace between `low` and `high` (V or A).

    `share` of `full_scale` (V or A, the whole screen) is the limit of a difference between two points, wherever they are: a trace
    over a third of the screen has three times the share. A trace far from zero is measured from there.
    Source: "dual cursor accuracy" of Keysight's data sheet 5992-0140, which is the DC vertical gain accuracy, of full scale.
    """
    span = max(high - low, abs(low), abs(high))
    return share * full_scale / span if span > 0.0 else share
