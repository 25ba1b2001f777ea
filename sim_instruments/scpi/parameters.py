"""From data elements to values: numbers with units and limits, words, booleans, channel lists (SCPI-99 volume 1)."""

import re
from collections.abc import Iterable, Mapping

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import Argument

_MULTIPLIERS = {
    "": 1.0, "EX": 1e18, "PE": 1e15, "T": 1e12, "G": 1e9, "MA": 1e6, "K": 1e3,
    "M": 1e-3, "U": 1e-6, "N": 1e-9, "P": 1e-12, "F": 1e-15, "A": 1e-18,
}  # fmt: skip
# IEEE 488.2, 7.7.3: with these two units M alone means mega.
_MEGA = {"HZ", "OHM"}
_RANGE = re.compile(r"(\d+)(?::(\d+))?")


def forms(mnemonic: str) -> tuple[str, str]:
    """Return short and long form, in upper case, of a mnemonic written as in a manual (`VOLTage`)."""
    short = "".join(character for character in mnemonic if not character.islower())
    return short, mnemonic.upper()


def exactly(arguments: tuple[Argument, ...], least: int, most: int | None = None) -> None:
    """Check the number of data elements. Raises ScpiError -109 or -108."""
    if len(arguments) < least:
        raise ScpiError(-109)
    if len(arguments) > (least if most is None else most):
        raise ScpiError(-108)


def scale(suffix: str, unit: str) -> float:
    """Return the factor that a suffix like MV stands for, in the unit V. Raises ScpiError -131 or -138."""
    if not suffix:
        return 1.0
    if not unit:
        raise ScpiError(-138)
    if not suffix.endswith(unit):
        raise ScpiError(-131)
    prefix = suffix[: -len(unit)]
    if unit in _MEGA and prefix == "M":
        return 1e6
    try:
        return _MULTIPLIERS[prefix]
    except KeyError:
        raise ScpiError(-131) from None


def number(
    argument: Argument, low: float, high: float, *, default: float | None = None, unit: str = "", slack: float = 1e-9
) -> float:
    """Return a number within its limits, MINimum, MAXimum and DEFault included. Raises ScpiError, -222 out of range."""
    if argument.kind == "word":
        if argument.text in ("MIN", "MINIMUM"):
            return low
        if argument.text in ("MAX", "MAXIMUM"):
            return high
        if argument.text in ("DEF", "DEFAULT") and default is not None:
            return default
        raise ScpiError(-141)
    if argument.kind != "number":
        raise ScpiError({"string": -158, "block": -168, "expression": -178}[argument.kind])
    value = argument.value * scale(argument.suffix, unit)
    margin = slack * (abs(low) + abs(high) if abs(low) + abs(high) < float("inf") else 0.0)
    if not low - margin <= value <= high + margin:
        raise ScpiError(-222)
    return min(max(value, low), high)


def integer(argument: Argument, low: int, high: int, *, default: int | None = None) -> int:
    """Return a number rounded to an integer. Raises ScpiError, -222 out of range."""
    return round(number(argument, low, high, default=default))


def boolean(argument: Argument) -> bool:
    """Return ON, OFF or a number as a truth value. Raises ScpiError."""
    if argument.kind == "word":
        if argument.text in ("ON", "OFF"):
            return argument.text == "ON"
        raise ScpiError(-141)
    if argument.kind != "number":
        raise ScpiError(-104)
    return round(argument.value) != 0


def choices(mnemonics: Iterable[str]) -> Mapping[str, str]:
    """Return a table from every accepted spelling to the short form that the instrument replies with."""
    table: dict[str, str] = {}
    for mnemonic in mnemonics:
        short, long = forms(mnemonic)
        table[short] = table[long] = short
    return table


def choice(argument: Argument, table: Mapping[str, str]) -> str:
    """Return the short form of a word from a table made by `choices`. Raises ScpiError -141 or -104."""
    if argument.kind != "word":
        raise ScpiError(-104)
    try:
        return table[argument.text]
    except KeyError:
        raise ScpiError(-141) from None


def string(argument: Argument) -> str:
    """Return a quoted string. Raises ScpiError -104 for anything else."""
    if argument.kind != "string":
        raise ScpiError(-104)
    return argument.text


def channel_list(argument: Argument, highest: int) -> tuple[int, ...]:
    """Return the channels of a list like (@1,3) or (@1:3). Raises ScpiError -171, or -222 for one not there."""
    if argument.kind != "expression" or not argument.text.strip().startswith("@"):
        raise ScpiError(-104 if argument.kind != "expression" else -171)
    channels: list[int] = []
    for part in argument.text.strip()[1:].split(","):
        if len(part) == 1 and "1" <= part <= "9" and int(part) <= highest:
            channels.append(int(part))
            continue
        match = _RANGE.fullmatch("".join(part.split()))
        if match is None:
            raise ScpiError(-171)
        if max(len(group or "") for group in match.groups()) > 4:
            raise ScpiError(-222)
        first, last = int(match.group(1)), int(match.group(2) or match.group(1))
        if not (1 <= first <= highest and 1 <= last <= highest):
            raise ScpiError(-222)
        channels.extend(range(first, last + 1) if first <= last else range(first, last - 1, -1))
    return tuple(channels)
