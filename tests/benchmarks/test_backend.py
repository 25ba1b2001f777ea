"""Queries a second and megabytes a second through the in-process backend."""

from collections.abc import Iterator

import numpy as np
import pytest
import pyvisa
from pytest_benchmark.fixture import BenchmarkFixture

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.transports.visa.library import InProcessVisaLibrary

NAME = "TCPIP0::box::inst0::INSTR"
QUERIES = 1000
BLOCK = bytes(1_000_000)


class Box(ScpiInstrument):
    """An instrument that knows who it is and has a block."""

    def __init__(self) -> None:
        super().__init__(VirtualClock(), np.random.default_rng(0), "MAKER,BOX,1,2")
        reply = b"#8%08d" % len(BLOCK) + BLOCK
        self.tree.add("CURVe", query=lambda _: reply)

    def reset(self) -> None:
        """Nothing is set."""


@pytest.fixture
def session() -> Iterator[pyvisa.resources.MessageBasedResource]:
    library = InProcessVisaLibrary({NAME: Box()})
    resource = pyvisa.ResourceManager(library).open_resource(NAME, read_termination="\n", write_termination="\n")
    yield resource
    library.shut()


def test_queries(benchmark: BenchmarkFixture, session: pyvisa.resources.MessageBasedResource) -> None:
    def ask() -> str:
        for _ in range(QUERIES):
            reply = session.query("*IDN?")
        return reply

    assert benchmark(ask) == "MAKER,BOX,1,2"
    benchmark.extra_info["queries"] = QUERIES


def test_parsed_messages(benchmark: BenchmarkFixture, session: pyvisa.resources.MessageBasedResource) -> None:
    messages = [f"*ESE {value % 256};*ESE?" + " " * (value // 256) for value in range(QUERIES)]

    def ask() -> str:
        for message in messages:
            reply = session.query(message)
        return reply

    assert benchmark(ask) == f"+{(QUERIES - 1) % 256}"


@pytest.mark.parametrize("chunk", [20 * 1024, 1 << 24], ids=["chunks of 20 kB", "in one"])
def test_blocks(benchmark: BenchmarkFixture, session: pyvisa.resources.MessageBasedResource, chunk: int) -> None:
    session.read_termination = None
    length = len(BLOCK) + 11

    def transfer() -> int:
        session.write("CURV?")
        return len(session.read_bytes(length, chunk_size=chunk))

    assert benchmark(transfer) == length
