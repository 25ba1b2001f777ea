"""Strokes between two current vectors: what is sent when, what comes back, and what is refused."""

import math
import struct
from typing import Any

import pytest

from drivers.interfaces import InstrumentError, ReportedError, SetpointError
from tests.drivers.mjbots.test_moteus import Opened


def commanded(moteus: Any) -> list[tuple[float, float]]:
    """The d and q currents of the frames that command them and ask for position and currents, in order."""
    made = []
    for _, data in moteus.requests:
        raw = bytes.fromhex(data)
        if raw[:5] == b"\x01\x00\x09\x0e\x1c" and b"\x1e\x01" in raw:
            q, d = struct.unpack("<2f", raw[5:13])
            made.append((d, q))
    return made


def test_strokes_alternate_the_first_and_the_last_half_as_long_and_end_without_current(
    opened: Opened, moteus: Any
) -> None:
    inverter = opened()
    with inverter.driving_dq_current(0.0, 0.0):
        moteus.requests.clear()
        samples = inverter.alternate_dq_current(-3.0, 4.0, -3.0, -4.0, 0.02, 5)
        assert commanded(moteus) == [(-3.0, 4.0), (-3.0, -4.0), (-3.0, 4.0), (-3.0, -4.0), (-3.0, 4.0), (0.0, 0.0)]
    times = [one.time - samples[0].time for one in samples]
    assert times == pytest.approx([0.0, 0.01, 0.03, 0.05, 0.07, 0.08, 0.1], abs=2e-3)
    # Each was read in the frame that ends it.
    assert [(one.d_current, one.q_current) for one in samples] == [
        (0.0, 0.0), (-3.0, 4.0), (-3.0, -4.0), (-3.0, 4.0), (-3.0, -4.0), (-3.0, 4.0), (0.0, 0.0)
    ]  # fmt: skip
    assert moteus.mode == 0


def test_an_even_number_has_one_more(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    with inverter.driving_dq_current(0.0, 0.0):
        assert len(inverter.alternate_dq_current(1.0, 0.0, -1.0, 0.0, 0.004, 4)) == 7


def test_the_angle_goes_on_from_the_drives_own(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    with inverter.driving_dq_current(0.0, 0.0):
        samples = inverter.alternate_dq_current(0.0, 1.0, 0.0, -1.0, 0.004, 3)
    # Poles of the made-up drive: 14; 2.5 turns a second.
    assert [one.electrical_angle for one in samples] == pytest.approx([1.5] * len(samples))
    assert samples[0].electrical_speed == pytest.approx(2.0 * math.pi * 2.5 * 7)


def test_beyond_a_limit_nothing_is_sent(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    with inverter.driving_dq_current(0.0, 0.0):
        moteus.requests.clear()
        for wrong in (
            (21.0, 0.0, 1.0, 0.0, 0.01, 3),
            (1.0, 0.0, 15.0, 15.0, 0.01, 3),
            (1.0, 0.0, -1.0, 0.0, 1e-4, 3),
            (1.0, 0.0, -1.0, 0.0, math.nan, 3),
            (1.0, 0.0, -1.0, 0.0, 0.01, 101),
        ):
            with pytest.raises(SetpointError, match="nothing was sent"):
                inverter.alternate_dq_current(*wrong)
        assert not moteus.requests


def test_outside_of_a_block_nothing_is_sent(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    moteus.requests.clear()
    with pytest.raises(InstrumentError, match="it regulates no current; nothing was sent"):
        inverter.alternate_dq_current(1.0, 0.0, -1.0, 0.0, 0.01, 3)
    assert not moteus.requests


def test_a_drive_that_stops_meanwhile_ends_the_strokes(opened: Opened, moteus: Any) -> None:
    inverter = opened()
    command, seen = moteus._command, []

    def trips(mode: int, written: dict[int, float]) -> None:
        command(mode, written)
        seen.append(mode)
        if seen.count(9) == 3:
            moteus.mode, moteus.code = 1, 33

    moteus._command = trips
    with pytest.raises(ReportedError, match="the drive is in fault 33"), inverter.driving_dq_current(0.0, 0.0):
        inverter.alternate_dq_current(1.0, 0.0, -1.0, 0.0, 0.01, 5)
    assert moteus.mode == 0
