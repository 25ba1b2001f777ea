"""GW Instek GPT-9803 and GPT-9804 safety testers as insulation testers.

Sources: the GPT-9800 Series User Manual (remote control), and public programs used with testers of the series, which send
MANU:IR:REF 0 and *RMTOFF, and end each line with CR LF. Those that send TEST:RET send ON, for the OK that ends a test; here it
is OFF, and the end is asked for. What was left of these is put back at the end; voltage, limits and times stay.
"""

import math
import re
from dataclasses import dataclass
from typing import Any, Self

from drivers.bases.always import always
from drivers.bases.scpi_driver import ScpiDriver
from drivers.bases.set_points import check_setpoint, lesser
from drivers.catalogue import Surroundings
from drivers.gwinstek import gpt9800_data as data
from drivers.gwinstek.gpt9800_settings import FOUND_SETTINGS, plain
from drivers.gwinstek.options import IDENTITY, Gpt9800Options
from drivers.interfaces import (
    BreakdownError,
    Clock,
    CommunicationError,
    InsulationReading,
    InsulationTester,
    MeasurementError,
    Reading,
    ReportedError,
    SetpointError,
    polls,
)
from drivers.interfaces.text import text
from drivers.transport.visa.opening import identify
from drivers.transport.visa.session import WAY_DOWN_TIME, ScpiSession

START, STOP = "FUNC:TEST ON", "FUNC:TEST OFF"
STATE_QUERY, READING_QUERY = "FUNC:TEST?", "MEAS?"
#: How often (s) the tester is looked at, and how much longer (s) than it should a test may take.
_LOOK, _MARGIN = 0.1, 3.0
#: A test is over with these; while it lasts it says TEST, before it VIEW.
_JUDGED = ("PASS", "FAIL")
#: How long (s) a voltage that a judged test shows may be the present one: the tester discharges faster.
_HELD = 1.0
#: A test that ended this much (s) before its time was broken off.
_TIME_STEP = 0.1

_REPLY = re.compile(
    r">?\s*IR\s*,\s*(?P<status>[A-Z ]+?)\s*,\s*(?P<voltage>\d+\.?\d*)\s*kV\s*,"
    r"\s*(?P<beyond>>?)\s*(?P<resistance>\d+\.?\d*)\s*(?P<unit>[MG])\s*ohm\s*,\s*(?P<phase>[TR])?=?\s*(?P<time>[\d.\-]+)\s*S\s*",
    re.ASCII,
)


#: A number that is zero, whatever unit follows.
_ZERO = re.compile(r"\s*[+-]?(?=[\d.])0*\.?0*(?![\d.])", re.ASCII)
_OUTPUT = re.compile(r">?\s*(?:ACW|DCW|IR)\s*,\s*([A-Z ]+?)\s*,\s*(\d+\.?\d*)\s*kV\s*,.*", re.ASCII)
#: The earth bond test puts out volts, and shows amperes.
_EARTH_BOND = re.compile(r">?\s*GB\s*,\s*([A-Z ]+?)\s*,.*", re.ASCII)


@dataclass(frozen=True)
class Output:
    """Status and voltage (V) that MEAS? shows, in any function."""

    status: str
    voltage: float


@dataclass(frozen=True)
class Report:
    """Reply to MEAS?: status, voltage (V), resistance (Ω), whether that is beyond the range, and the test's time (s).

    `time` is NaN outside a test, and that of the ramp while `ramping`.
    """

    status: str
    voltage: float
    resistance: float
    beyond_range: bool
    time: float
    ramping: bool


def parse_report(reply: str) -> Report:
    """Return what a reply to MEAS? tells of an insulation test; raises ValueError on another form."""
    match = _REPLY.fullmatch(reply)
    if match is None:
        raise ValueError(text("no reading of an insulation test"))
    scale = {"M": 1.0, "G": 1e3}[match["unit"]] * data.MEGOHM
    resistance = float(match["resistance"]) * scale
    beyond = bool(match["beyond"]) or resistance >= data.LARGEST
    time = math.nan if "-" in match["time"] else float(match["time"])
    return Report(match["status"], float(match["voltage"]) * 1e3, resistance, beyond, time, match["phase"] == "R")


def parse_output(reply: str) -> Output:
    """Return status and voltage in a reply to MEAS?; raises ValueError on another form."""
    if (match := _OUTPUT.fullmatch(reply)) is not None:
        return Output(match[1], float(match[2]) * 1e3)
    if (bond := _EARTH_BOND.fullmatch(reply)) is not None:
        return Output(bond[1], 0.0)
    raise ValueError(text("no reading of a test"))


class GwInstekGpt9800(ScpiDriver, InsulationTester):
    """A GPT-9803 or GPT-9804; the tester is identified when this is made, and asked what it was left with.

    Raises IdentityError where another instrument, or a model without an insulation test, answers.
    """

    _local = "*RMTOFF"

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: Gpt9800Options,
        *,
        name: str = "insulation_tester",
        guarding: bool = False,
    ) -> None:
        super().__init__(session, clock, name)
        self._options = options
        self._identity = identify(session, IDENTITY, options.serial_number)
        self._maximum_voltage, self._owner = lesser(data.HIGHEST_VOLTAGE, options.maximum_voltage)
        check_setpoint(name, "ramp_time", options.ramp_time, "s", data.SHORTEST_RAMP, data.LONGEST_RAMP, "the model")
        if not guarding:
            session.check_left_errors()
            self._take_over(FOUND_SETTINGS, plain)

    @classmethod
    def open(cls, address: str, options: Any, surroundings: Surroundings, name: str, **line: Any) -> Self:
        """Open a GPT-9803 or GPT-9804 at a VISA address, as any other, at the station's rate.

        Raises CommunicationError where nothing answers, IdentityError where something else does.
        """
        return super().open(address, options, surroundings, name, baud_rate=options.baud_rate, line_end="\r\n", **line)

    @property
    def maximum_voltage(self) -> float:
        """Largest test voltage (V): the lesser of the model's and the station's."""
        return self._maximum_voltage

    def measure(self, voltage: float, duration: float) -> InsulationReading:
        """Apply `voltage` (V DC) for `duration` (s), read the resistance at its end, discharge, and return.

        The output is off and discharged when this returns or raises. Raises SetpointError outside the allowed range or
        between the model's steps of 50 V, BreakdownError where the test did not reach its voltage,
        MeasurementError where it was broken off.
        """
        self._check(voltage, duration)
        with always(self.make_safe, self._session.calls):
            self._prepare(voltage, duration)
            self._session.send(START)
            report = self._await_end(duration)
        return self._judged(report, voltage, duration)

    def make_safe(self) -> None:
        """End the test, and return once the output is off and the object discharged.

        Over a renewed connection where the present one fails. Raises ReportedError where it stays on or charged.
        """
        with self._session.within(WAY_DOWN_TIME):
            self._session.insist(self._stop)
            self._await_discharge()

    def _check(self, voltage: float, duration: float) -> None:
        name = self._name
        check_setpoint(name, "voltage", voltage, "V", data.LOWEST_VOLTAGE, self._maximum_voltage, self._owner)
        steps = voltage / data.VOLTAGE_STEP
        if not math.isclose(steps, round(steps)):
            low = math.floor(steps) * data.VOLTAGE_STEP
            whose = text("the model between its steps of {step:g} V", step=data.VOLTAGE_STEP)
            raise SetpointError(name, "voltage", voltage, "V", low, low, whose)
        check_setpoint(name, "duration", duration, "s", data.SHORTEST_TEST, data.LONGEST_TEST, "the model")

    def _prepare(self, voltage: float, duration: float) -> None:
        session = self._session
        kilovolts = f"{voltage / 1e3:.3f}"
        for command in (
            STOP,
            "MAIN:FUNC MANU",
            "MANU:EDIT:MODE IR",
            f"MANU:RTIM {self._options.ramp_time:.1f}",
            f"MANU:IR:VOLT {kilovolts}",
            # Between the widest limits the tester judges nothing and does not end a test before its time.
            f"MANU:IR:RHIS {data.LARGEST / data.MEGOHM:.0f}",
            "MANU:IR:RLOS 1",
            f"MANU:IR:TTIM {duration:.1f}",
            # A reference that the last user left is subtracted from the resistance.
            "MANU:IR:REF 0",
            # Results that the tester sends unasked would be taken for other replies.
            "TEST:RET OFF",
        ):
            session.write(command)
        held = session.query("MANU:IR:VOLT?")
        if held.strip().removesuffix("kV").strip() != kilovolts:
            raise ReportedError(
                self._name,
                text("the test voltage is '{held}' instead of {kilovolts} kV", held=held, kilovolts=kilovolts),
                command="MANU:IR:VOLT?",
            )

        reference = session.query("MANU:IR:REF?")
        if not _ZERO.match(reference):
            raise ReportedError(
                self._name,
                text("a reference of '{reference}' is still subtracted from the resistance", reference=reference),
                command="MANU:IR:REF?",
                remedy=text("Set REF to 0 at the tester"),
            )

    def _await_end(self, duration: float) -> Report:
        self._clock.sleep(self._options.ramp_time + duration)
        for last in polls(self._clock, _MARGIN, _LOOK):
            if (report := self._report()).status in _JUDGED:
                break
            if last:
                self._session.check_errors(START)
                raise MeasurementError(
                    self._name,
                    text(
                        "the test has not ended {margin:g} s after its time (it says {status})",
                        margin=_MARGIN,
                        status=report.status,
                    ),
                    command=START,
                    remedy=text("Check the tester's interlock, its start enable and its menu"),
                )
        return report

    def _report(self) -> Report:
        reply = self._session.query(READING_QUERY)
        try:
            return parse_report(reply)
        except ValueError as error:
            raise self._unusable(reply, error) from error

    def _judged(self, report: Report, voltage: float, duration: float) -> InsulationReading:
        least = voltage * (1.0 - data.VOLTAGE_GAIN) - data.VOLTAGE_OFFSET
        # Below its range the tester judges at once.
        below = report.status == "FAIL" and report.resistance <= data.RESOLUTION
        if report.voltage < least or (report.ramping and not below):
            raise BreakdownError(
                self._name,
                text("the test reached {voltage:g} V of {wanted:g} V", voltage=report.voltage, wanted=voltage),
                command=READING_QUERY,
                remedy=text("Check the winding for a short circuit to the frame, then the leads"),
            )
        if not (below or report.time >= duration - _TIME_STEP):
            raise MeasurementError(
                self._name,
                text(
                    "the test ended {status} after {time:g} s of {duration:g} s",
                    status=report.status,
                    time=report.time,
                    duration=duration,
                ),
                command=READING_QUERY,
                remedy=text("Somebody may have stopped it at the front panel; check the leads"),
            )
        accuracy = self._options.accuracy or data.stated_accuracy(report.resistance, voltage)
        resistance = Reading(report.resistance, "Ω", accuracy, self._clock.now())
        return InsulationReading(resistance, report.voltage, report.beyond_range)

    def _stop(self) -> None:
        """End the test and wait until the tester says so: it may not before it has discharged the object."""
        self._session.send(STOP)
        for last in polls(self._clock, self._options.discharge_timeout, _LOOK):
            if (said := self._session.query(STATE_QUERY).upper()).split()[-1:] == ["OFF"]:
                break
            if last:
                raise ReportedError(
                    self._name,
                    text("the output is still on ('{reply}')", reply=said),
                    command=STOP,
                    remedy=text("Press STOP at the tester, and touch nothing"),
                )

    def _await_discharge(self) -> None:
        """Wait until MEAS? shows no dangerous voltage; a judged test may keep showing the one it ended with."""
        begun = self._clock.now()
        while True:
            waited = self._clock.now() - begun
            if (left := self._left()).voltage <= data.HARMLESS:
                return
            if left.status in _JUDGED and waited >= _HELD:
                return
            if waited >= self._options.discharge_timeout:
                raise ReportedError(
                    self._name,
                    text(
                        "{voltage:g} V are left {waited:.1f} s after the output went off",
                        voltage=left.voltage,
                        waited=waited,
                    ),
                    command=READING_QUERY,
                    remedy=text("Touch nothing; short the winding to the frame by an earthing stick"),
                )
            self._clock.sleep(_HELD if left.status in _JUDGED else _LOOK)

    def _left(self) -> Output:
        reply = self._session.query(READING_QUERY)
        try:
            return parse_output(reply)
        except ValueError as error:
            raise self._unusable(reply, error) from error

    def _unusable(self, reply: str, error: ValueError) -> CommunicationError:
        return CommunicationError(
            self._name, text("unusable reply '{reply}' ({error})", reply=reply, error=error), command=READING_QUERY
        )
