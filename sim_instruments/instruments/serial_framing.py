"""Character framing of a unit on a serial line, by its own parameters."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SerialFraming:
    """Rate (bit/s), data bits, parity (N, E, O), stop bits, and whether frames are Modbus ASCII in place of RTU."""

    rate: int
    bits: int = 8
    parity: str = "N"
    stop: int = 2
    ascii: bool = False

    def hears(self, rate: int | None, *, odd: bool, in_ascii: bool) -> bool:
        """Say whether a frame is understood that came at a rate, with odd parity or without, in ASCII or RTU.

        A receiver looks at the first stop bit only, so their number does not matter.
        """
        return (rate, odd, in_ascii) == (self.rate, self.parity == "O", self.ascii)
