"""What a driver costs beyond the raw transport, each time two things in one run.

Run with `pytest tests/benchmarks/test_driver_overhead.py --benchmark-enable -n 0`; the figures are in `extra_info`.
"""

import statistics
import timeit
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import pyvisa
from pyvisa import constants
from pyvisa.attributes import AttributesByID
from pyvisa.highlevel import VisaLibraryBase
from pyvisa.util import LibraryPath

from drivers.bases.waveform import Preamble, to_values
from drivers.catalogue import Surroundings
from drivers.keysight.e36300 import KeysightE36300
from drivers.keysight.options import E36300Options

ADDRESS = "TCPIP0::supply::inst0::INSTR"
REPLIES = {
    b"*IDN?\n": b"Keysight Technologies,E36313A,MY1,1.0\n",
    b"SYST:ERR?\n": b'+0,"No error"\n',
    b"MEAS:VOLT? (@1)\n": b"+1.19990000E+00\n",
    b"OUTP:PAIR?\n": b"OFF\n",
    b"OUTP:TRAC?\n": b"0\n",
    b"VOLT:MODE? (@1)\n": b"FIX\n",
    b"CURR:MODE? (@1)\n": b"FIX\n",
    b"VOLT:SENS? (@1)\n": b"INT\n",
    b"SYST:LOC\n": b"",
}


class InstantLibrary(VisaLibraryBase):
    """The least VISA library that answers."""

    @staticmethod
    def get_library_paths() -> tuple[LibraryPath]:
        return (LibraryPath("unset"),)

    def _init(self) -> None:
        self.reply = b""
        self.attributes: dict[Any, Any] = {constants.ResourceAttribute.resource_name: ADDRESS}

    def open_default_resource_manager(self) -> Any:
        return 1, constants.StatusCode.success

    def open(self, *_: Any) -> Any:
        return 2, constants.StatusCode.success

    def close(self, session: Any) -> Any:
        return constants.StatusCode.success

    def read(self, session: Any, count: int) -> Any:
        return self.reply, constants.StatusCode.success

    def write(self, session: Any, data: bytes) -> Any:
        self.reply = REPLIES[data]
        return len(data), constants.StatusCode.success

    def get_attribute(self, session: Any, attribute: Any) -> Any:
        return self.attributes.get(attribute, AttributesByID[attribute].default), constants.StatusCode.success

    def set_attribute(self, session: Any, attribute: Any, state: Any) -> Any:
        self.attributes[attribute] = state
        return constants.StatusCode.success

    def disable_event(self, *_: Any) -> Any:
        return constants.StatusCode.success

    def discard_events(self, *_: Any) -> Any:
        return constants.StatusCode.success


class StillClock:
    def now(self) -> float:
        return 0.0

    def sleep(self, seconds: float) -> None:
        raise AssertionError(seconds)


@pytest.fixture
def manager() -> Iterator[pyvisa.ResourceManager]:
    library = InstantLibrary("unset")
    library._init()
    made = pyvisa.ResourceManager(library)
    yield made
    made.close()


def seconds(action: Callable[[], object], number: int) -> float:
    """Median over rounds of the time (s) of one call."""
    return statistics.median(timeit.repeat(action, number=number, repeat=5)) / number


def test_read_of_a_supply_against_the_raw_query(benchmark: Any, manager: pyvisa.ResourceManager) -> None:
    supply = KeysightE36300.open(ADDRESS, E36300Options(), Surroundings(StillClock(), lambda: manager), "supply")
    raw: Any = manager.open_resource(ADDRESS, write_termination="\n")

    def plain() -> float:
        return float(raw.query("MEAS:VOLT? (@1)"))

    assert supply.measure_voltage().value == plain() == 1.1999
    benchmark(supply.measure_voltage)
    if benchmark.enabled:
        driver, transport = seconds(supply.measure_voltage, 2000), seconds(plain, 2000)
        benchmark.extra_info["driver / raw query"] = round(driver / transport, 2)
        benchmark.extra_info["more per read (µs), at most 30"] = round((driver - transport) * 1e6, 2)
    supply.close()
    raw.close()


def test_conversion_of_ten_million_points_against_plain_numpy(benchmark: Any) -> None:
    points = 10_000_000 if benchmark.enabled else 100_000
    block = np.arange(points, dtype=np.uint32).astype("<u2").tobytes()
    preamble = Preamble(points, 1e-6, 0.0, 0.0, 1.25e-4, 0.5, 32768.0)

    def driver() -> Any:
        return to_values(np.frombuffer(block, dtype="<u2"), preamble)

    def plain() -> Any:
        return np.frombuffer(block, dtype="<u2") * preamble.y_increment + (
            preamble.y_origin - preamble.y_reference * preamble.y_increment
        )

    np.testing.assert_allclose(driver(), plain(), rtol=0, atol=1e-12)
    benchmark.pedantic(driver, rounds=5)
    if benchmark.enabled:
        benchmark.extra_info["plain numpy / driver, at least 0.8"] = round(seconds(plain, 1) / seconds(driver, 1), 2)
