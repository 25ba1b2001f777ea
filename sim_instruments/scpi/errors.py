"""Standard errors of SCPI and the queue that a client reads them from (SCPI-99 volume 2, chapter 21.8)."""

from collections import deque

MESSAGES = {
    0: "No error",
    -100: "Command error",
    -101: "Invalid character",
    -102: "Syntax error",
    -103: "Invalid separator",
    -104: "Data type error",
    -105: "GET not allowed",
    -108: "Parameter not allowed",
    -109: "Missing parameter",
    -113: "Undefined header",
    -114: "Header suffix out of range",
    -121: "Invalid character in number",
    -123: "Exponent too large",
    -128: "Numeric data not allowed",
    -131: "Invalid suffix",
    -138: "Suffix not allowed",
    -141: "Invalid character data",
    -148: "Character data not allowed",
    -151: "Invalid string data",
    -158: "String data not allowed",
    -161: "Invalid block data",
    -168: "Block data not allowed",
    -171: "Invalid expression",
    -178: "Expression data not allowed",
    -200: "Execution error",
    -211: "Trigger ignored",
    -213: "Init ignored",
    -214: "Trigger deadlock",
    -203: "Command protected",
    -221: "Settings conflict",
    -222: "Data out of range",
    -223: "Too much data",
    -224: "Illegal parameter value",
    -230: "Data corrupt or stale",
    -240: "Hardware error",
    -241: "Hardware missing",
    -310: "System error",
    -350: "Queue overflow",
    -363: "Input buffer overrun",
    -410: "Query INTERRUPTED",
    -420: "Query UNTERMINATED",
    -430: "Query DEADLOCKED",
    -440: "Query UNTERMINATED after indefinite response",
}

QUERY_ERROR, DEVICE_ERROR, EXECUTION_ERROR, COMMAND_ERROR = 0x04, 0x08, 0x10, 0x20


class ScpiError(Exception):
    """An error that the instrument puts into its queue: a number and the maker's text."""

    def __init__(self, number: int, text: str | None = None) -> None:
        self.number = number
        self.text = MESSAGES.get(number, "Device-specific error") if text is None else text
        super().__init__(f"{number},{self.text}")

    @property
    def event_bit(self) -> int:
        """Bit of the standard event status register that this error sets (IEEE 488.2, 11.5.1.1)."""
        if -199 <= self.number <= -100:
            return COMMAND_ERROR
        if -299 <= self.number <= -200:
            return EXECUTION_ERROR
        if -499 <= self.number <= -400:
            return QUERY_ERROR
        return DEVICE_ERROR


class ErrorQueue:
    """First-in first-out queue of bounded depth; when it overflows, its last entry becomes -350."""

    def __init__(self, depth: int = 20) -> None:
        if depth < 2:
            raise ValueError(f"an error queue of depth {depth} cannot tell of its overflow; the least is 2")
        self.depth = depth
        self._entries: deque[ScpiError] = deque()

    def __len__(self) -> int:
        return len(self._entries)

    def push(self, error: ScpiError) -> None:
        """Append an error, or mark the overflow."""
        if len(self._entries) >= self.depth:
            self._entries[-1] = ScpiError(-350)
        else:
            self._entries.append(error)

    def pop(self) -> ScpiError:
        """Take the oldest error, or error 0."""
        return self._entries.popleft() if self._entries else ScpiError(0)

    def clear(self) -> None:
        """Forget all errors."""
        self._entries.clear()
