"""What one count of a velocity is: by the drive's factor group, by the station, or refused with the key to give."""

import math
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoAbortedError
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402.velocity import open_velocity
from drivers.cia402.velocity_unit import VelocityUnit, read_unit, read_vl_unit, stated_unit
from drivers.interfaces import ReportedError
from drivers.transport.can.objects import NodeObjects


class Objects:
    """Objects of four bytes by index and subindex; what is not there is aborted."""

    def __init__(self, values: dict[tuple[int, int], int]) -> None:
        self.values = values
        self.written: list[tuple[int, bytes]] = []

    def upload(self, index: int, subindex: int) -> bytes:
        if (index, subindex) not in self.values:
            raise SdoAbortedError(0x06020000)
        return (self.values[index, subindex] & 0xFFFFFFFF).to_bytes(4, "little")

    def download(self, index: int, subindex: int, data: bytes, force_segment: bool = False) -> None:
        self.written.append((index, data))


def ratio(index: int, above: int, below: int = 1) -> dict[tuple[int, int], int]:
    return {(index, 1): above, (index, 2): below}


def unit(stated: str = "", increments: int | None = None, **values: Any) -> VelocityUnit:
    return read_unit(NodeObjects(Objects(values.get("of", {})), "drive"), stated, increments)


RPM = {(0x60A9, 0): 0x00B44700}
ENCODER = ratio(0x608F, 4096)


@pytest.mark.parametrize(
    ("values", "counts"),
    [
        (RPM, 60.0),
        ({(0x60A9, 0): 0xFFB44700}, 600.0),  # 0.1 rpm
        ({(0x60A9, 0): 0x01B44700}, 6.0),  # 10 rpm
        ({(0x60A9, 0): 0x00B40300}, 1.0),  # turns a second
        ({(0x60A9, 0): 0xFD410300}, 360_000.0),  # thousandths of a degree a second
        ({(0x60A9, 0): 0x00100300}, 2.0 * math.pi),  # radians a second
        ({(0x60A9, 0): 0x00B50300} | ENCODER, 4096.0),
        # Units of position a second, with the velocity factor at 1:1.
        (ENCODER | ratio(0x6096, 1), 4096.0),
        (ENCODER | ratio(0x6096, 1) | ratio(0x6092, 3600), 3600.0),
        (ENCODER | ratio(0x6096, 1) | ratio(0x6092, 3600) | ratio(0x6091, 5), 720.0),
        # Velocity factors in both senses that makers give them, each beside its 60A9h.
        ({(0x60A9, 0): 0xFCB44700} | ratio(0x608F, 1 << 20) | ratio(0x6096, 600_000, 1 << 20), 600_000.0),
        (RPM | ratio(0x608F, 2000) | ratio(0x6096, 1, 60), 60.0),
    ],
)
def test_what_a_drive_says(values: dict[tuple[int, int], int], counts: float) -> None:
    found = unit(of=values)
    assert (found.counts, found.electrical) == (pytest.approx(counts), False)


@pytest.mark.parametrize(
    ("stated", "values", "said"),
    [
        ("", {}, r"does not state the unit of its velocity.*velocity_unit"),
        ("", ENCODER, r"does not state the unit of its velocity.*velocity_unit"),
        # An encoder at 1:1 was never set up.
        ("", ratio(0x608F, 1) | ratio(0x6096, 1) | ratio(0x6092, 1), "velocity_unit"),
        ("", {(0x60A9, 0): 0x00C04700}, "velocity_unit"),
        ("", {(0x60A9, 0): 0x00B54700}, "Set increments_per_turn"),
        ("counts/s", {}, "Set increments_per_turn"),
        ("0.1 rpm", RPM, r"0x60A9 says 1 rpm, which contradicts a velocity unit of 0\.1 rpm"),
        ("Hz", RPM, r"0x60A9 says 1 rpm, which contradicts a velocity unit of 1 Hz"),
        ("rpm", ENCODER | ratio(0x6096, 7, 3), r"0x6096 says 2\.33333, which contradicts a velocity unit of 1 rpm"),
        ("", RPM | ratio(0x6091, 5), r"gear of 5 \(0x6091\)"),
    ],
)
def test_what_is_refused_names_the_object_or_the_key(stated: str, values: Any, said: str) -> None:
    with pytest.raises(ReportedError, match=said):
        unit(stated, of=values)


def test_a_gear_is_explained_by_the_station() -> None:
    assert unit("rpm", of=RPM | ratio(0x6091, 5)).counts == 60.0
    assert unit("counts/s", 1000, of=ENCODER).counts == 1000.0
    # Counts of an encoder that nobody knows contradict nothing.
    assert unit("rpm", of={(0x60A9, 0): 0x00B50300}).counts == 60.0


@pytest.mark.parametrize("stated", ["", "rpm/s", "0 rpm", "-1 rpm", "1e999 rpm", "rpm 1", "0,1 rpm", "kHz"])
def test_what_is_no_unit(stated: str) -> None:
    with pytest.raises(ValueError, match="is no unit of velocity; allowed are rpm"):
        stated_unit(stated)


def test_the_velocity_mode_counts_rpm() -> None:
    assert read_vl_unit(NodeObjects(Objects({}), "drive"), "").counts == 60.0
    factor = NodeObjects(Objects(ratio(0x604C, 1, 60)), "drive")
    assert read_vl_unit(factor, "0.1 rpm").counts == pytest.approx(600.0)
    with pytest.raises(ReportedError, match="encoder whose resolution the drive does not say"):
        read_vl_unit(factor, "counts/s")
    with pytest.raises(ReportedError, match=r"0x604C\) is 0\.0166667.*velocity_unit"):
        read_vl_unit(factor, "")


@given(st.integers(-6, 3), st.sampled_from([(0xB4, "rps"), (0x41, "deg/s"), (0x10, "rad/s")]))
def test_a_stated_unit_and_the_drives_own_agree(prefix: int, kind: tuple[int, str]) -> None:
    code = (prefix & 0xFF) << 24 | kind[0] << 16 | 0x0300
    own, said = unit(of={(0x60A9, 0): code}), stated_unit(f"1e{prefix} {kind[1]}")
    assert said is not None
    assert own.agrees(said)
    assert not own.agrees(VelocityUnit(own.counts * 1.001))


@given(st.integers(-6, 0), st.integers(1, 50), st.floats(-1000.0, 1000.0))
def test_a_commanded_frequency_is_read_within_half_a_count(prefix: int, pole_pairs: int, frequency: float) -> None:
    objects = Objects({(0x60A9, 0): (prefix & 0xFF) << 24 | 0xB44700})
    velocity = open_velocity(NodeObjects(objects, "drive"), 3, "", increments=None, pole_pairs=pole_pairs)
    if abs(round(frequency * velocity.counts)) >= 2**31:
        with pytest.raises(ReportedError, match="0x60FF does not hold"):
            velocity.command(frequency)
        return
    velocity.command(frequency)
    ((index, data),) = objects.written
    assert index == 0x60FF
    objects.values[0x606C, 0] = int.from_bytes(data, "little", signed=True)
    assert velocity.read(velocity.objects) == pytest.approx(frequency, abs=0.51 / velocity.counts)
    # Turns a minute of a machine with these pole pairs.
    assert velocity.counts == pytest.approx(60.0 * 10.0**-prefix / pole_pairs)
