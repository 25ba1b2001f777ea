"""Blocks over HiSLIP, a raw socket and VXI-11, from an instrument on real sockets."""

import time
from collections.abc import Callable

import numpy as np
import pytest
import pyvisa

from drivers.catalogue import Surroundings
from drivers.interfaces import CommunicationError
from drivers.transport.visa.opening import open_session
from sim_instruments.faults.line_faults import Fault
from sim_instruments.server.served_bench import ServedBench

SETTING = "*RST;:TIM:RANG 0.0008;:WAV:POIN:MODE RAW;:WAV:POIN 200000;:WAV:FORM WORD;:WAV:BYT LSBF;:SING"


class Wall:
    def now(self) -> float:
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        raise AssertionError(seconds)


def test_a_block_is_the_same_by_every_way_and_leaves_the_session_in_step(
    served_bench: Callable[..., ServedBench],
) -> None:
    bench = served_bench(seed=1)
    manager = pyvisa.ResourceManager("@py")
    records = []
    for way, address in bench.addresses()["oscilloscope"].items():
        session = open_session(str(address), Surroundings(Wall(), lambda: manager), "oscilloscope", timeout=5.0)
        try:
            identity = session.identity_line()
            if not records:
                session.complete(SETTING)
            records.append(np.frombuffer(session.query_block(":WAV:DATA?"), dtype="<u2"))
            assert session.query_number(":WAV:POIN?") == 200_000
            bench.bench.faults("oscilloscope").add(Fault.on("half", "WAV:DATA"))
            with pytest.raises(CommunicationError, match=r"of 400000 announced bytes came"):
                session.query_block(":WAV:DATA?", timeout=0.3)
            assert session.query("*IDN?") == identity, way
        finally:
            session.close()
    assert [record.size for record in records] == [200_000] * 3
    for record in records[1:]:
        np.testing.assert_array_equal(record, records[0])
