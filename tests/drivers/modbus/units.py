"""The two units of a dynamometer on Modbus, and the line to them."""

import math
import os
import select
import socket
import threading
from collections.abc import Callable

from drivers.delta.options import DeltaDyn200Options

RPM = 2 * math.pi / 60
OPTIONS = DeltaDyn200Options(maximum_speed=200.0, settle_timeout=2.0, watchdog_time=0.0)


class Units:
    """Registers of the two units, with a machine that follows its command at once."""

    def __init__(self) -> None:
        self.registers: dict[tuple[int, int], int] = {
            **{(1, address): 0 for address in (0x2000, 0x2001, 0x2002, 0x2100, 0x2102, 0x2103, 0x2104)},
            **{(1, address): 0 for address in (0x000A, 0x0016, 0x0B22)},
            # 00-00, 09-30, 00-20, 00-21, 11-27, 11-33, 11-36 to 11-38
            (1, 0x0000): 5,
            (1, 0x091E): 0,
            (1, 0x0014): 1,
            (1, 0x0015): 2,
            (1, 0x0B1B): 100,
            (1, 0x0B21): 1,
            (1, 0x0B24): 1,
            (1, 0x0B25): 100,
            (1, 0x0B26): 100,
            **{(2, address): 0 for address in range(0x24)},
            (2, 0x09): 4,
            (2, 0x21): 2,
        }
        self.writes: list[tuple[int, int, list[int]]] = []
        self.refuse: dict[tuple[int, int], int] = {}  # (unit, address) → exception
        self.keeps: dict[tuple[int, int], int] = {}  # registers that acknowledge a write and stay what they are
        self.coils: list[tuple[int, int, int]] = []
        self.zeroes = True
        self.speed_decimals = 2
        self.reverse = False
        self.stuck = False
        self.slip = 1.0
        self.ripple = 0.0  # by how much the speed's reading rises and falls, a sixth of a turn a reading
        self.turned = 0.0

    def answer(self, unit: int, pdu: bytes) -> bytes | None:
        function, address, third = pdu[0], int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
        if unit not in (1, 2):
            return None
        if code := self.refuse.get((unit, address)):
            return bytes([function | 0x80, code])
        if function == 5:
            self.coils.append((unit, address, third))
            if self.zeroes:
                self.set_32(0x00, 0)
            return pdu[:5]
        if function == 3:
            if self.ripple and unit == 2:
                self.turned += math.pi / 3
                self.follow()
            wanted = [(unit, address + offset) for offset in range(third)]
            if any(key not in self.registers for key in wanted):
                return bytes([0x83, 2])
            data = b"".join(self.registers[key].to_bytes(2, "big") for key in wanted)
            return bytes([3, len(data)]) + data
        values = [third] if function == 6 else [int.from_bytes(pdu[i : i + 2], "big") for i in range(6, len(pdu), 2)]
        self.writes.append((unit, address, values))
        for offset, value in enumerate(values):
            self.registers[unit, address + offset] = self.keeps.get((unit, address + offset), value)
        self.follow()
        return pdu[:5]

    def follow(self) -> None:
        if self.stuck:
            return
        command = self.registers[1, 0x2000]
        running, reverse = command & 3 == 2, command >> 4 & 3 == 2
        counts = self.registers[1, 0x2001] if running else 0
        self.registers[1, 0x2103] = counts
        if running and self.registers[1, 0x000A] == 0:
            self.set_speed(counts * 0.01 * 60 / 2 * self.slip * (1 + self.ripple * math.sin(self.turned)), reverse)

    def set_speed(self, rpm: float, reverse: bool = False) -> None:
        self.set_32(0x02, round(rpm * 10**self.speed_decimals))
        self.reverse = reverse

    def set_32(self, address: int, value: int) -> None:
        self.registers[2, address], self.registers[2, address + 1] = value >> 16 & 0xFFFF, value & 0xFFFF

    @property
    def command(self) -> int:
        return self.registers[1, 0x2000]


class TcpServer:
    """Modbus TCP on loopback, keeping every request to the byte."""

    def __init__(self, units: Units) -> None:
        self.units = units
        self.requests: list[str] = []
        self.hang_up_on = 0  # how many requests are answered by closing the connection, unheard
        self.garble: Callable[[bytes], bytes] = lambda reply: reply
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"tcp://127.0.0.1:{self.listener.getsockname()[1]}"
        self.wake, self.woken = os.pipe()
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self) -> None:
        connections: list[socket.socket] = []
        while True:
            ready, _, _ = select.select([self.listener, self.wake, *connections], [], [])
            if self.wake in ready:
                break
            for source in ready:
                if source is self.listener:
                    connections.append(self.listener.accept()[0])
                    continue
                request = source.recv(300)
                if not request or self.hang_up_on:
                    self.hang_up_on -= bool(request)
                    connections.remove(source)
                    source.close()
                    continue
                self.requests.append(request.hex(" "))
                reply = self.units.answer(request[6], request[7:])
                if reply is not None:
                    head = request[:4] + (len(reply) + 1).to_bytes(2, "big") + request[6:7]
                    source.sendall(self.garble(head + reply))
        for source in connections:
            source.close()

    def close(self) -> None:
        os.write(self.woken, b"x")
        self.thread.join()
        self.listener.close()
        os.close(self.wake)
        os.close(self.woken)
