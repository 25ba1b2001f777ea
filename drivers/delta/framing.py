"""Framing of a C2000's serial line, found and set over the line itself: 09-00 the unit, 09-01 the rate, 09-04 the format.

The formats are those of the C2000's and CP2000's manuals (12.1-09); the GS4, which Delta makes for another brand, has the same, and so are
the unit's 1 … 254. As delivered: unit 1, 9600 bit/s, 7N2 in ASCII (the maker alone). Whether a new framing acts at once or once the power
has been off no source tells: after each write the drive is asked at the new framing, then at the one before.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from urllib.parse import urlsplit

from drivers.catalogue import Surroundings
from drivers.delta.dyn200 import Dyn200
from drivers.delta.options import DeltaDyn200Options
from drivers.delta.recognition import DRIVE
from drivers.framing import FoundFraming, Framing
from drivers.interfaces import CommunicationError, InstrumentError, ReportedError
from drivers.interfaces.text import Text, text, word
from drivers.transport.modbus.framed_address import framed, framing_of
from drivers.transport.modbus.line import LINE_ERRORS, RTU_SILENCE, ModbusLine, client_for, open_line

UNIT, RATE, FORMAT = 0x0900, 0x0901, 0x0904
_STATUS = 0x2101
_EIGHT_BITS = ("8N1", "8N2", "8E1", "8O1", "8E2", "8O2")
#: What 09-04 stands for, from 1 on: form, and ASCII or not.
FORMATS = tuple(
    [(form, True) for form in ("7N2", "7E1", "7O1", "7E2", "7O2", *_EIGHT_BITS)]
    + [(form, False) for form in _EIGHT_BITS]
)
_FIRST_RTU = 12
RATES = (9600, 19200, 38400, 57600, 115200, 4800)
DELIVERED = Framing(9600, "7N2", True, 1)
#: A DYN-200 speaks RTU without parity; 19200 bit/s is the most that its maker's manual names (one program has 38400).
SENSOR_FORMS, SENSOR_RATE = ("8N2", "8N1"), 19200
_HIGHEST_UNIT = 254
#: How long (s) the drive may take to answer where it should be, and where it may be one of many framings.
_ANSWER_TIME, _SEARCH_TIME = 0.5, 0.15
#: How often it is asked after a change, and how long (s) it is left alone before.
_ATTEMPTS, _PAUSE = 3, 0.1
#: Output current (0.01 A) that a sensor shows although nothing flows, at most.
_NO_CURRENT = 10


@dataclass(frozen=True)
class _Step:
    """One parameter to write, and what of the framing changes with it."""

    address: int
    name: str
    value: int
    after: Callable[[Framing], Framing]


class DriveFraming:
    """The C2000 of one dynamometer; `address` and `options` are the station file's, `name` stands for it in messages."""

    def __init__(self, address: str, options: DeltaDyn200Options, surroundings: Surroundings, name: str) -> None:
        if urlsplit(address).scheme != "rtu":
            raise ReportedError(
                name,
                text("{address} is no serial port of this computer", address=address),
                remedy=text(
                    "Rate and format of a line behind a gateway are set at the gateway, too: connect drive and sensor to an adapter "
                    "here, with an address like rtu:///dev/ttyUSB0?baudrate=19200&parity=N&stopbits=2"
                ),
            )
        self._address = address
        self._options = options
        self._surroundings = surroundings
        self._name = name
        try:
            self.present = Framing(*framing_of(address), options.drive_unit)
        except ValueError as error:
            raise CommunicationError(
                name, text("'{address}' is no Modbus address ({error})", address=address, error=error)
            ) from error

    def wanted(self, rate: int | None, form: str | None, unit: int | None) -> Framing:
        """Return the framing asked for, the station file's where nothing is; raises ReportedError for one that drive or sensor has not."""
        present = self.present
        wanted = Framing(
            present.rate if rate is None else rate,
            present.form if form is None else form.upper(),
            present.in_ascii if form is None else False,
            present.unit if unit is None else unit,
        )
        possible = tuple(rate for rate in sorted(RATES) if rate <= SENSOR_RATE)
        if wanted.rate not in possible:
            raise self._unfit(f"{wanted.rate} bit/s", possible)
        if wanted.form not in SENSOR_FORMS or wanted.in_ascii:
            raise self._unfit(
                f"{wanted.form} {'ASCII' if wanted.in_ascii else 'RTU'}",
                tuple(f"{form} RTU" for form in SENSOR_FORMS),
            )
        if wanted.unit == self._options.transducer_unit:
            raise ReportedError(
                self._name,
                text("unit {unit} is the sensor's (transducer_unit)", unit=wanted.unit),
                remedy=text("Give the drive another number with --unit, 1 to {highest}", highest=_HIGHEST_UNIT),
            )
        if not 1 <= wanted.unit <= _HIGHEST_UNIT:
            raise ReportedError(
                self._name,
                text(
                    "a C2000 cannot be unit {unit}; allowed is 1 to {highest}", unit=wanted.unit, highest=_HIGHEST_UNIT
                ),
            )
        return wanted

    def find(self, say: Callable[[Text], None]) -> FoundFraming:
        """Look for the drive by reading alone, first where the station file says, then as delivered, then in every framing that it has."""
        self._open_once()
        for at in dict.fromkeys((self.present, DELIVERED)):
            if (result := self._found_at(at)) is not None:
                return self._as_stored(result)
        units = tuple(dict.fromkeys((self.present.unit, DELIVERED.unit)))
        ways = [(rate, *form) for rate in RATES for form in (*FORMATS[_FIRST_RTU - 1 :], *FORMATS[: _FIRST_RTU - 1])]
        say(
            text(
                "{name}: no drive at {present}, nor as delivered; looking in {count} framings, at most {seconds:.0f} s",
                name=word(self._name),
                present=self.present.words,
                count=len(ways),
                seconds=len(ways) * len(units) * (_SEARCH_TIME + 2 * RTU_SILENCE),
            )
        )
        for way in ways:
            for unit in units:
                if self._answers(Framing(*way, unit), _SEARCH_TIME) and (result := self._found_at(Framing(*way, unit))):
                    return self._as_stored(result)
        # An adapter that was unplugged meanwhile is another cause than a silent drive.
        self._open_once()
        raise CommunicationError(
            self._name,
            text("no C2000 answers on {address} in any framing as unit {units}", address=self._path, units=units),
            remedy=text(
                "Check its power, A and B of the cable, and 09-00 at its keypad; other units than these are asked where the "
                "station file's drive_unit says so"
            ),
        )

    def refuse(self, found: FoundFraming, wanted: Framing) -> None:
        """Raise ReportedError while the drive puts something out, or where another unit answers already as it is to."""
        with self._line(found.at) as line:
            state, _, frequency, current = line.read(found.at.unit, _STATUS, 4, "state and output")
        if state & 0b11 or frequency or current > _NO_CURRENT:
            raise ReportedError(
                self._name,
                text(
                    "the drive runs (2101H = {state:04X}H, {frequency:g} Hz, {current:g} A); nothing was set",
                    state=state,
                    frequency=frequency * 0.01,
                    current=current * 0.01,
                ),
                remedy=text("Stop it and wait until the shaft is at rest"),
            )
        # With another number of stop bits the drive itself may answer.
        elsewhere = (wanted.rate, wanted.in_ascii, wanted.unit) != (found.at.rate, found.at.in_ascii, found.at.unit)
        if elsewhere and self._answers(wanted, _ANSWER_TIME):
            raise ReportedError(
                self._name,
                text("another unit answers at {framing} already; nothing was set", framing=wanted.words),
                remedy=text("Give the drive another number with --unit, 1 to {highest}", highest=_HIGHEST_UNIT),
            )

    def set(self, found: FoundFraming, wanted: Framing) -> Framing:
        """Write what differs, find the drive again after each parameter, and read everything back; return where it answers."""
        self.refuse(found, wanted)
        at = found.at
        for step in _steps(found.stored, wanted):
            at = self._taken(step, at, wanted)
        again = self._found_at(at)
        if again is None:
            raise self._lost(text("it was set"), (at,), wanted)
        if again.stored != wanted:
            raise ReportedError(
                self._name,
                text("the drive says {stored} after {wanted} was set", stored=again.stored.words, wanted=wanted.words),
                remedy=_way_back(wanted),
            )
        return at

    def partners(self, wanted: Framing) -> tuple[Text, ...]:
        """Say whether the sensor answers with a framing, and what to set at it where it does not."""
        unit = self._options.transducer_unit
        try:
            with self._line(wanted) as line:
                Dyn200(line, unit, speed_decimals=0)
        except InstrumentError:
            return (
                text(
                    "the DYN-200 does not answer at {framing}: at the sensor set parameters 08 to {rate}, 11 to {form}, 10 to {unit} "
                    "and 09 to 1 (K1 held, K1 again for the next page)",
                    framing=replace(wanted, unit=unit).words,
                    rate=wanted.rate,
                    form=wanted.form,
                    unit=unit,
                ),
            )
        return (text("the DYN-200 answers at {framing}", framing=replace(wanted, unit=unit).words),)

    def entries(self, wanted: Framing) -> dict[str, object]:
        """Return address and unit for the station file."""
        return {"address": self._framed(wanted), "drive_unit": wanted.unit}

    def _as_stored(self, found: FoundFraming) -> FoundFraming:
        """Return what was found at the framing of its parameters, where it answers there: stop bits too many or too few go unnoticed."""
        return (found.at != found.stored and self._found_at(found.stored)) or found

    @property
    def _path(self) -> str:
        return urlsplit(self._address).path

    def _framed(self, framing: Framing) -> str:
        return framed(self._address, framing.rate, framing.form, in_ascii=framing.in_ascii)

    @contextmanager
    def _line(self, framing: Framing) -> Iterator[ModbusLine]:
        self._surroundings.clock.sleep(RTU_SILENCE)
        line = open_line(
            self._framed(framing),
            self._name,
            timeout=_ANSWER_TIME,
            clock=self._surroundings.clock,
            wire=self._surroundings.wire,
        )
        try:
            yield line
        finally:
            line.close()

    def _open_once(self) -> None:
        """Raise CommunicationError with the reason where the port itself cannot be opened."""
        with self._line(self.present):
            pass

    def _answers(self, framing: Framing, timeout: float) -> bool:
        """Say whether anybody answers, whatever it is; asked once, within `timeout` (s)."""
        self._surroundings.clock.sleep(RTU_SILENCE)
        client = client_for(self._framed(framing), timeout)
        try:
            client.connect()
            client.read_holding_registers(0, count=1, device_id=framing.unit)
        except LINE_ERRORS:
            return False
        finally:
            client.close()  # type: ignore[no-untyped-call]
        return True

    def _found_at(self, at: Framing) -> FoundFraming | None:
        """Return the drive that answers at a framing, with what its parameters say; None where none does."""
        try:
            with self._line(at) as line:
                blocks = {first: tuple(line.read(at.unit, first, count, "identity")) for first, count in DRIVE.reads}
                recognition = DRIVE.recognise(blocks)
                if recognition is None:
                    return None
                unit, rate, form = (line.read(at.unit, number, 1, "framing")[0] for number in (UNIT, RATE, FORMAT))
        except (CommunicationError, ReportedError):
            return None
        if not 1 <= form <= len(FORMATS):
            raise ReportedError(
                self._name,
                text(
                    "the drive at {framing} has 09-04 = {form}, which is no format known (1 to {highest})",
                    framing=at.words,
                    form=form,
                    highest=len(FORMATS),
                ),
                remedy=text("Set 09-04 at its keypad: 13 is 8N2 RTU"),
            )
        return FoundFraming(recognition, at, Framing(100 * rate, *FORMATS[form - 1], unit))

    def _taken(self, step: _Step, at: Framing, wanted: Framing) -> Framing:
        """Write one parameter and return the framing that the drive answers at then."""
        # Its answer may come in the new framing already.
        try:
            with self._line(at) as line, suppress(CommunicationError):
                line.write(at.unit, step.address, step.value, step.name)
        except ReportedError as error:
            raise ReportedError(
                self._name,
                text("{what} was not set to {value}: {reason}", what=step.name, value=step.value, reason=error.what),
                command=f"{step.address:04X}H",
                remedy=_locked(at),
            ) from error
        places = tuple(dict.fromkeys((step.after(at), at)))
        for _ in range(_ATTEMPTS):
            for place in places:
                self._surroundings.clock.sleep(_PAUSE)
                found = self._read_back(place, step)
                if found is None:
                    continue
                if found != step.value:
                    raise ReportedError(
                        self._name,
                        text(
                            "{what} is {found} after {value} was written", what=step.name, found=found, value=step.value
                        ),
                        command=f"{step.address:04X}H",
                        remedy=_locked(place),
                    )
                return place
        raise self._lost(text("{what} was set to {value}", what=step.name, value=step.value), places, wanted)

    def _read_back(self, at: Framing, step: _Step) -> int | None:
        try:
            with self._line(at) as line:
                return line.read(at.unit, step.address, 1, step.name)[0]
        except (CommunicationError, ReportedError):
            return None

    def _lost(self, after: Text, places: tuple[Framing, ...], wanted: Framing) -> CommunicationError:
        where = [place.words for place in places]
        return CommunicationError(
            self._name,
            text("after {what} the drive does not answer; it may be at {places}", what=after, places="; ".join(where)),
            remedy=_way_back(wanted),
        )

    def _unfit(self, asked: str, possible: tuple[object, ...]) -> ReportedError:
        return ReportedError(
            self._name,
            text(
                "drive and sensor (DYN-200) do not both support {asked}; allowed is {possible}",
                asked=asked,
                possible=possible,
            ),
        )


def parameters(framing: Framing) -> dict[int, int]:
    """Return the values of 09-00, 09-01 and 09-04 for a framing."""
    form = FORMATS.index((framing.form, framing.in_ascii)) + 1
    return {RATE: framing.rate // 100, FORMAT: form, UNIT: framing.unit}


def _steps(stored: Framing, wanted: Framing) -> list[_Step]:
    values, now = parameters(wanted), parameters(stored)
    every = (
        _Step(RATE, "09-01 rate", values[RATE], lambda at: replace(at, rate=wanted.rate)),
        _Step(
            FORMAT,
            "09-04 format",
            values[FORMAT],
            lambda at: replace(at, form=wanted.form, in_ascii=wanted.in_ascii),
        ),
        _Step(UNIT, "09-00 unit", values[UNIT], lambda at: replace(at, unit=wanted.unit)),
    )
    return [step for step in every if now[step.address] != step.value]


def _locked(place: Framing) -> Text:
    return text(
        "It answers at {place}. See whether its parameters are locked, or set it at the keypad", place=place.words
    )


def _way_back(wanted: Framing) -> Text:
    values = parameters(wanted)
    return text(
        "At its keypad set 09-00 = {unit}, 09-01 = {rate:g} and 09-04 = {form}, switch its power off and on, and run "
        "motorbench station check; or run this command again, which looks for it in every framing",
        unit=values[UNIT],
        rate=values[RATE] / 10,
        form=values[FORMAT],
    )
