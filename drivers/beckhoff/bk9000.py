"""A relay terminal on a Beckhoff Bus Coupler for Modbus TCP (BK9000, BK9050, BK9100), which the coupler's watchdog opens.

Beckhoff Information System, Modbus TCP interface: 0x100C status, 0x1120 time in ms, 0x1121 reset, 0x1122 by which telegrams it is fed;
digital outputs are coils from 0. The watchdog begins with the first telegram that writes process data.
"""

from collections.abc import Callable
from contextlib import suppress

from drivers.bases.set_points import check_setpoint
from drivers.delta.options import BeckhoffRelayOptions
from drivers.interfaces import CommunicationError, ReportedError, Watchdog
from drivers.interfaces.text import text
from drivers.transport.modbus.line import ModbusLine, open_line

STATUS, TIME, RESET, TYPE = 0x100C, 0x1120, 0x1121, 0x1122
#: Status: the watchdog has run out.
ELAPSED = 0x8000
#: Only telegrams that write process data feed it, so that a reader cannot keep it alive.
WRITE_TELEGRAMS = 0
#: One after the other, they reset the watchdog; its time can be set only while it does not run.
RESET_WORDS = (0xBECF, 0xAFFE)
TIME_STEP = 1e-3
SHORTEST_TIME, LONGEST_TIME = 0.2, 65.0
_HIGHEST_OUTPUT, _HIGHEST_UNIT = 0xFFFF, 255


class BeckhoffRelay:
    """One output; the coupler is asked for its status when this is made, and nothing is changed before `pick_up`.

    Raises SetpointError for an option that cannot be, CommunicationError where the coupler does not answer.
    """

    def __init__(self, line: ModbusLine, options: BeckhoffRelayOptions, *, name: str) -> None:
        check_setpoint(name, "output", options.output, "", 0, _HIGHEST_OUTPUT, "Modbus")
        check_setpoint(name, "unit", options.unit, "", 0, _HIGHEST_UNIT, "Modbus")
        check_setpoint(
            name, "watchdog_time", options.watchdog_time, "s", SHORTEST_TIME, LONGEST_TIME, "the model (0x1120)"
        )
        self._line = line
        self._options = options
        self._name = name
        self._before: dict[int, int] = {}
        self._elapsed()

    @property
    def watchdog(self) -> Watchdog:
        """The coupler's watchdog."""
        return self._options.watchdog

    def picked_up(self) -> bool:
        """Return whether the output is on; a coupler whose watchdog has run out has none on."""
        return not self._elapsed() and self._output()

    def pick_up(self) -> None:
        """Arm the watchdog, switch the output on and make sure of both.

        Raises ReportedError where the coupler refuses or does not keep a setting, CommunicationError where it does not answer.
        """
        wanted = {TYPE: WRITE_TELEGRAMS, TIME: round(self._options.watchdog_time / TIME_STEP)}
        found = {address: self._read(address) for address in wanted}
        changed = {address: value for address, value in wanted.items() if found[address] != value}
        if changed or self._elapsed():
            self._reset()
        for address, value in changed.items():
            self._before.setdefault(address, found[address])
            self._write(address, value)
            if (kept := self._read(address)) != value:
                raise ReportedError(
                    self._name,
                    text(
                        "register {address:04X}H is {kept} after {value} was written",
                        address=address,
                        kept=kept,
                        value=value,
                    ),
                    command=f"{address:04X}H",
                    remedy=text("Set it with the maker's configuration software, or restart the coupler"),
                )
        self._switch(True)
        if not self._output():
            raise ReportedError(
                self._name, text("output {output} stays off", output=self._options.output), command=self._command
            )

    def feed(self) -> None:
        """Write the output once more, so that it stays on for another `watchdog_time`.

        Raises ReportedError where the watchdog has run out or the output is off, CommunicationError where nobody answers.
        """
        if self._elapsed():
            raise ReportedError(
                self._name,
                text(
                    "has dropped out: it was not fed for {watchdog_time:g} s", watchdog_time=self._options.watchdog_time
                ),
                command=f"{STATUS:04X}H",
                remedy=text("Find out what delayed the run, then start again"),
            )
        self._switch(True)
        if not self._output():
            raise ReportedError(self._name, text("has dropped out: its output is off"), command=self._command)

    def drop_out(self) -> None:
        """Switch the output off and make sure of it, over a renewed connection where the present one fails.

        Raises ReportedError where it stays on, CommunicationError where nobody answers.
        """
        self._or_renewed(self._off)

    def close(self) -> None:
        """Put the watchdog's settings back where they were changed, over a renewed connection where the present one fails, and close it;
        may be called twice.

        Raises InstrumentError where the coupler does not take them.
        """
        before, self._before = self._before, {}

        def put_back() -> None:
            self._reset()
            for address, value in before.items():
                self._write(address, value)

        try:
            if before:
                self._or_renewed(put_back)
        finally:
            self._line.close()

    def _or_renewed(self, act: Callable[[], None]) -> None:
        try:
            act()
        except CommunicationError:
            self._line.reopen()
            act()

    def _off(self) -> None:
        # A coupler whose watchdog has run out has switched off, and may refuse process data.
        with suppress(ReportedError):
            self._switch(False)
        if self.picked_up():
            raise ReportedError(
                self._name,
                text("output {output} stays on", output=self._options.output),
                command=self._command,
                remedy=text("Press the emergency stop"),
            )

    def _elapsed(self) -> bool:
        return bool(self._read(STATUS) & ELAPSED)

    def _reset(self) -> None:
        for word in RESET_WORDS:
            self._write(RESET, word)

    @property
    def _command(self) -> str:
        return f"coil {self._options.output} of unit {self._options.unit}"

    def _output(self) -> bool:
        return self._line.read_coil(self._options.unit, self._options.output, "digital output")

    def _switch(self, on: bool) -> None:
        self._line.write_coil(self._options.unit, self._options.output, on, "digital output")

    def _read(self, address: int) -> int:
        return self._line.read(self._options.unit, address, 1, "watchdog")[0]

    def _write(self, address: int, value: int) -> None:
        self._line.write(self._options.unit, address, value, "watchdog")


def open_beckhoff_relay(address: str, options: BeckhoffRelayOptions, *, name: str) -> BeckhoffRelay:
    """Open the coupler at `tcp://host:port`; raises what the class and the connection raise."""
    line = open_line(address, name, timeout=options.timeout)
    try:
        return BeckhoffRelay(line, options, name=name)
    except BaseException:
        line.close()
        raise
