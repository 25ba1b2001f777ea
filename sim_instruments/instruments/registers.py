"""Instruments behind Modbus: holding registers that are read and written in blocks."""

from typing import Protocol, runtime_checkable

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, DEVICE_FAILURE = 1, 2, 3, 4


class RegisterError(Exception):
    """A request that the device refuses, with the exception code of Modbus."""

    def __init__(self, code: int, message: str) -> None:
        self.code = code
        super().__init__(message)


class NoAnswerError(Exception):
    """A request that the device does not hear as one: it stays silent."""


class RegisterDevice(Protocol):
    """A unit on a Modbus line."""

    @property
    def unit(self) -> int:
        """Return the unit identifier."""

    @property
    def ranges(self) -> tuple[tuple[int, int], ...]:
        """Return first address and number of registers of each block that exists, in ascending order."""

    @property
    def readings(self) -> tuple[int, int, int]:
        """Return first address and number of the registers that hold readings, and how many make up one."""

    def read(self, address: int, count: int) -> list[int]:
        """Return registers. Raises RegisterError."""

    def write(self, address: int, values: list[int]) -> None:
        """Write registers. Raises RegisterError."""


@runtime_checkable
class BitDevice(Protocol):
    """A unit that has single bits: coils and discrete inputs, the same ones."""

    def read_bits(self, address: int, count: int) -> list[bool]:
        """Return bits. Raises RegisterError."""


@runtime_checkable
class OutputDevice(Protocol):
    """A unit whose coils can be written."""

    def write_bit(self, address: int, on: bool) -> None:
        """Write a coil. Raises RegisterError."""


def exists(ranges: tuple[tuple[int, int], ...], address: int, count: int) -> bool:
    """Return whether all the registers exist; the ranges are in ascending order."""
    end = address + count
    for start, length in ranges:
        if start <= address < start + length:
            address = start + length
    return address >= end


def double_word(value: int) -> list[int]:
    """Return a 32-bit number in two's complement, high word first."""
    value = max(-0x80000000, min(0x7FFFFFFF, value)) & 0xFFFFFFFF
    return [value >> 16, value & 0xFFFF]


def signed(value: int) -> int:
    """Return a register as a signed number."""
    return value - 0x10000 if value & 0x8000 else value
