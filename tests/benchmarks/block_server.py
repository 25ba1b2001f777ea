"""An instrument in a process of its own whose one reply is a block of so many words: `python -m tests.benchmarks.block_server POINTS`."""

import asyncio
import json
import sys

import numpy as np

from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.instruments.oscilloscope.transfer import as_words, block
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.session import ClientSession
from sim_instruments.scpi.tree import bare
from sim_instruments.transports.conversation import Conversation
from sim_instruments.transports.hislip.server import HislipServer
from sim_instruments.transports.scpi_socket import ScpiSocket
from sim_instruments.transports.tcp_service import TcpService


class Source(ScpiInstrument):
    """Has no settings."""

    def reset(self) -> None:
        """Nothing is to be reset."""


async def serve(points: int) -> None:
    """Serve by HiSLIP and by a raw socket until the process ends; the addresses are printed as JSON."""
    clock, generator = PacedClock(), np.random.default_rng(1)
    source = Source(clock, generator, "Motorbench,Source,1,1.0", queue_depth=10)
    words = np.arange(points, dtype=np.uint32).astype(np.uint16)
    source.tree.add(
        "WAVeform:DATA", query=bare(lambda: block(2 * points, as_words(words, unsigned=True, least_first=True)))
    )

    def converse() -> Conversation:
        return Conversation(ClientSession(source, generator), clock)

    hislip, socket = (
        TcpService(kind(converse).serve, "127.0.0.1")  # type: ignore[attr-defined]
        for kind in (HislipServer, ScpiSocket)
    )
    await hislip.start()
    await socket.start()
    addresses = {
        "hislip": f"TCPIP0::127.0.0.1::hislip0,{hislip.port}::INSTR",
        "socket": f"TCPIP0::127.0.0.1::{socket.port}::SOCKET",
    }
    print(json.dumps(addresses), flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(serve(int(sys.argv[1])))
