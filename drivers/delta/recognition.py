"""Recognition of a dynamometer's two units, by reading alone.

C2000: 00-00 is its identity, 2100H … its state (Delta's manuals); a public program for an MS300 reads them at the same places, so that
relatives are not told apart. DYN-200: 08H and 12H are the decimals of the torque and
its direction, a double word each (see `drivers.delta.dyn200`); it has nothing at 2100H, which of one sensor is known by simulation only.
"""

from drivers.interfaces.text import Text, text
from drivers.recognition import ModbusUnit, Registers

_IDENTITY, _STATE = 0x0000, 0x2100
_DECIMALS, _DIRECTION = 0x08, 0x12
_HIGHEST_CODE, _HIGHEST_DECIMALS = 0xFF, 6
_RTU = "baudrate={rate}&parity={parity}&stopbits={stop}"


def _drive(registers: Registers) -> Text | None:
    code = registers.get(_IDENTITY, (0,))[0]
    if _STATE in registers and 0 < code <= _HIGHEST_CODE:
        return text("Delta drive (a C2000 or a relative), 00-00 = {code}", code=code)
    return None


def _transducer(registers: Registers) -> Text | None:
    decimals, direction = registers.get(_DECIMALS, ()), registers.get(_DIRECTION, ())
    told = len(decimals) == 2 and decimals[0] == 0 and decimals[1] <= _HIGHEST_DECIMALS
    if told and direction in ((0, 0), (0, 1)) and _STATE not in registers:
        return text("DYN-200, torque with {decimals} decimals", decimals=decimals[1])
    return None


def _framings(*given: tuple[int, str, int]) -> tuple[str, ...]:
    return tuple(_RTU.format(rate=rate, parity=parity, stop=stop) for rate, parity, stop in given)


DRIVE = ModbusUnit(
    "Delta C2000",
    "drive_unit",
    ((_IDENTITY, 1), (_STATE, 2)),
    _drive,
    # 09-04: 12 … 15 in RTU; as delivered it is ASCII at 9600 bit/s.
    (
        *_framings((9600, "N", 2), (9600, "N", 1), (9600, "E", 1), (9600, "O", 1)),
        "baudrate=9600&bytesize=7&parity=N&stopbits=2&framer=ascii",
    ),
)
TRANSDUCER = ModbusUnit(
    "DYN-200",
    "transducer_unit",
    ((_DECIMALS, 2), (_DIRECTION, 2), (_STATE, 2)),
    _transducer,
    _framings((19200, "N", 2), (38400, "N", 2), (19200, "N", 1), (14400, "N", 1)),
)
