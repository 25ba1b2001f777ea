"""Settings that drive and transducer of a dynamometer may have been left with: parameters that decide what a command or a reading means.

Numbers and values of the C2000's are those of Delta's C2000 and CP2000 manuals (chapter 12) as others quote them: a public program
for a dynamometer with a C2000 (09-30, 11-27, 11-33, 11-34, 11-37), one for a positioner with C2000s (00-10), two public bridges
(00-20, 00-21); that 00-20 = 1 is RS-485, the manuals' pages on 09-10. The dynamometer's program cites the same manual, so group 11 has
one source. A public register table for the sister C200 has 11-36 to 11-38 too, but calls 11-27 the torque's source; the values of 11-36
are in none that was opened. That 00-21 = 2 is RS-485 is agreed for its sisters C200, MH300, MS300 and GS20 by three public sources that do
not copy each other; the C2000's own page was not seen. Compare what has one source with the drive's manual before its first use.
"""

from collections.abc import Mapping

from drivers.bases.found_state import FoundState, WantedSetting
from drivers.delta.dyn200 import INVERTED
from drivers.delta.options import DeltaDyn200Options
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import Text, text
from drivers.transport.modbus.line import ModbusLine, signed_32

#: That a register may be written.
_WRITE = "{value}"

#: Levels of a filter that lag by less than a reading takes. What a level is in seconds no source tells: 1 … 99, 20 as delivered
#: (manual) or 50 (two programs), "the larger, the more obvious the lag"; so it cannot be reckoned with or waited for.
_SHORTEST = ("1", "0", "2")
_FRAMING = text(
    "how its serial line is spoken to, as the address must say; motorbench station set-framing sets both units alike"
)
_BRAKED = text("in torque control the drive limits the shaft to a speed other than the motor's")
_FILTER_KEYS = text("At the sensor set parameter 02, and the speed's filter, to 1 (K1 held)")

#: What torque control needs besides.
TORQUE: Mapping[int, WantedSetting] = {
    0x0B1B: WantedSetting(
        "11-27 maximum torque (%)",
        ("100",),
        text("the torque command of 11-34 is a share of a different torque"),
        _WRITE,
    ),
    0x0B21: WantedSetting(
        "11-33 source of the torque command", ("1",), text("11-34 has no effect on the torque"), _WRITE
    ),
    0x0B24: WantedSetting(
        "11-36 what limits the speed", ("1", "2"), text("the frequency command does not limit the speed"), _WRITE
    ),
    # The motor turns the shaft against the torque: a lower limit brakes it there, whatever torque is commanded.
    0x0B25: WantedSetting("11-37 forward speed limit (% of 01-00)", ("100",), _BRAKED, _WRITE),
    0x0B26: WantedSetting("11-38 reverse speed limit (% of 01-00)", ("100",), _BRAKED, _WRITE),
}


def drive_rows(options: DeltaDyn200Options) -> Mapping[int, WantedSetting]:
    """Return what every use of the drive needs, by address (group and number are the bytes)."""
    code = () if options.drive_code is None else (str(options.drive_code),)
    framing = {
        address: WantedSetting(query, (), _FRAMING, optional=True)
        for address, query in (
            (0x0900, "09-00 unit"),
            (0x0901, "09-01 rate (0.1 kbit/s)"),
            (0x0904, "09-04 format (13: 8, N, 2 for RTU)"),
        )
    }
    return {
        **framing,
        0x0000: WantedSetting(
            "00-00 identity code",
            code,
            text("another drive may answer"),
            remedy=text("Correct address, drive_unit or drive_code"),
        ),
        0x091E: WantedSetting(
            "09-30 decoding of commands",
            ("0",),
            text("the drive does not take its commands from 2000H and 2001H"),
            _WRITE,
        ),
        0x0014: WantedSetting(
            "00-20 source of the frequency command",
            ("1",),
            text("2001H has no effect, the drive follows its keypad"),
            _WRITE,
        ),
        0x0015: WantedSetting(
            "00-21 source of the operation command",
            ("2",),
            text("2000H has no effect, the drive follows its keypad"),
            _WRITE,
            optional=True,
        ),
    }


def transducer_rows(options: DeltaDyn200Options) -> Mapping[int, WantedSetting]:
    """Return what is asked of the transducer, by address; two registers each."""
    wanted = "1" if options.torque_inverted else "0"
    return {
        INVERTED: WantedSetting(
            "12H torque direction (1: inverted)",
            (wanted,),
            text("every torque has the wrong sign"),
            remedy=text(
                "At the sensor set parameter 12 to {wanted} (K1 held, K1 to its page), or set torque_inverted in "
                "the station file if its mounting requires it",
                wanted=wanted,
            ),
        ),
        0x06: _filter(
            "06H filter of the torque", text("the torque reading lags behind the torque"), options.torque_filter
        ),
        0x1E: _filter("1EH filter of the speed", text("the speed reading lags behind the speed"), options.speed_filter),
    }


def _filter(query: str, effect: Text, stated: float) -> WantedSetting:
    """Return the row of a filter: as short as it gets, but one whose time constant (s) is stated stays as it is."""
    return WantedSetting(query, () if stated else _SHORTEST, effect, _WRITE, _FILTER_KEYS, optional=True)


class FoundDriveSettings:
    """Settings that drive and transducer on one line were left with."""

    def __init__(self, line: ModbusLine, options: DeltaDyn200Options) -> None:
        self._line = line
        self._options = options
        self._addresses: dict[str, int] = {}
        self._drive = FoundState(line.name, self._ask_drive, self._set_drive)
        self._transducer = FoundState(line.name, self._ask_transducer, self._set_transducer)

    @property
    def found(self) -> tuple[FoundSetting, ...]:
        """Settings as found."""
        return (*self._drive.settings, *self._transducer.settings)

    def take_over(self) -> None:
        """Ask everything, and set what may be set.

        Raises ReportedError where something is wrong that may not be set, or that does not stay as it was set.
        """
        sensor = transducer_rows(self._options)
        drive = {**drive_rows(self._options), **TORQUE}
        self._addresses = {row.query: address for address, row in (*sensor.items(), *drive.items())}
        self._transducer.take_over(sensor.values())
        self._drive.take_over(drive.values())

    def verify_torque(self) -> None:
        """Check that torque control still follows its commands; raises ReportedError if it does not."""
        self._addresses |= {row.query: address for address, row in TORQUE.items()}
        self._drive.verify(TORQUE.values())

    def give_back(self) -> None:
        """Set drive and transducer back as they were found; may be called twice."""
        self._drive.give_back()
        self._transducer.give_back()

    def _ask_drive(self, row: WantedSetting) -> str:
        return str(self._line.read(self._options.drive_unit, self._addresses[row.query], 1, row.query)[0])

    def _set_drive(self, row: WantedSetting, value: str) -> None:
        self._line.write(self._options.drive_unit, self._addresses[row.query], int(value), row.query)

    def _ask_transducer(self, row: WantedSetting) -> str:
        registers = self._line.read(self._options.transducer_unit, self._addresses[row.query], 2, row.query)
        return str(signed_32(*registers))

    def _set_transducer(self, row: WantedSetting, value: str) -> None:
        words = divmod(int(value), 1 << 16)
        self._line.write_block(self._options.transducer_unit, self._addresses[row.query], words, row.query)
