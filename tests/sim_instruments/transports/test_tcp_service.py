"""A port that is shut hangs up on everybody, however new the connection is."""

import asyncio
import socket

import pytest

from sim_instruments.transports.client import Client
from sim_instruments.transports.tcp_service import TcpService


async def _never_ends(client: Client) -> None:
    while await client.read(1):
        pass


@pytest.mark.parametrize("turns", range(8))
def test_a_client_that_comes_as_the_port_is_shut(turns: int) -> None:
    async def stop_after_turns() -> bytes:
        service = TcpService(_never_ends, "127.0.0.1")
        await service.start()
        with socket.create_connection(("127.0.0.1", service.port)) as client:
            client.setblocking(False)
            for _ in range(turns):
                await asyncio.sleep(0)
            await service.stop()
            async with asyncio.timeout(5.0):
                try:
                    return await asyncio.get_running_loop().sock_recv(client, 1)
                except ConnectionResetError:
                    return b""

    assert asyncio.run(stop_after_turns()) == b""


def test_a_port_can_be_opened_anew() -> None:
    async def open_again() -> bytes:
        service = TcpService(_never_ends, "127.0.0.1")
        await service.start()
        await service.stop()
        await service.start()
        reader, writer = await asyncio.open_connection("127.0.0.1", service.port)
        await service.stop()
        rest = await reader.read()
        writer.close()
        return rest

    assert asyncio.run(open_again()) == b""
