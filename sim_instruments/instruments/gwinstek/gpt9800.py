"""GW Instek GPT-9803 safety tester, insulation resistance in its manual mode (GPT-9800/9900 series user manual)."""

from typing import TYPE_CHECKING, Literal

import numpy as np

from sim_instruments.instruments.errors import InsulationErrors
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.parameters import choice, choices, exactly, number
from sim_instruments.scpi.tree import Call, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

#: What every test begins with, and what it takes at its end to discharge the object (s).
_INITIAL, _DISCHARGE = 0.1, 0.2
_HIGHEST = 9999.0
_STEP, _SHORTEST, _LONGEST = 0.05, 1.0, 999.9
_MODES = choices(("ACW", "DCW", "IR"))
_FUNCTIONS = choices(("MANU", "AUTO"))
_STATES = choices(("ON", "OFF"))
#: Numbers and texts of the tester's own error queue, by the classes of SCPI's.
_COMMAND, _VALUE, _MODE = (20, "Command Error"), (21, "Value Error"), (24, "Mode Error")
_KINDS = {-221: _MODE, -222: _VALUE, -224: _VALUE, -109: _VALUE, -104: _VALUE}

Verdict = Literal["VIEW", "TEST", "PASS", "FAIL"]


class Gpt9800(ScpiInstrument):
    """Simulated side of the tester. Only manual IR tests are there: 50 V … 1 kV in steps of 50 V, 1 … 9999 MΩ in steps of 1 MΩ.

    A test takes 0.1 s, the ramp, the test time and the discharge; it is judged at the end of the test time, and its result
    stands until the next one or OFF, after which the present voltage is shown. The object's frame is the tester's return.
    MANU:IR:REF is subtracted from the resistance before it is judged. With TEST:RET on, OK is sent unasked at the end of a
    test, passed, failed or stopped, and whoever asks next reads that first. Messages end with CR LF both ways; a message that
    ends with LF alone is taken too.
    """

    terminator = b"\r\n"
    leftovers = (
        ("MANU:EDIT:MODE IR;:MANU:IR:REF 100", "MANU:EDIT:MODE IR;:MANU:IR:REF 5000", ""),
        ("", "TEST:RET ON"),
        ("", "MANU:RTIM 5"),
        ("", "MANU:EDIT:MODE DCW", "MANU:EDIT:MODE ACW"),
        ("", "MAIN:FUNC AUTO"),
    )

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: InsulationErrors | None = None,
    ) -> None:
        super().__init__(world.clock, generator, "GPT-9803 ,EM110867    ,v2.08,", queue_depth=20)
        if world.insulation is None:
            raise ValueError("this bench has no insulation tester; give World fixture=True")
        self._insulation = world.insulation
        self._world = world
        self._random = generator
        self._unit = errors or InsulationErrors()
        self._function, self._mode = "MANU", "ACW"
        self._voltage, self._low, self._high = 0.05, 1.0, _HIGHEST
        self._reference, self._tells = 0.0, False
        self._test_time, self._ramp_time = 1.0, 0.1
        self._test = 0
        self._begun: float | None = None
        self._verdict: Verdict = "VIEW"
        self._shown = ""
        self._decides = self._ends = 0.0
        self._add_commands()

    def reset(self) -> None:
        """Do nothing: the tester has no *RST."""

    def _add_common(self) -> None:
        # Of IEEE 488.2 the manual has these two; beside them its own end of remote control and error query.
        self.tree.add("*IDN", query=bare(lambda: self.identity))
        self.tree.add("*CLS", command=bare(self._clear_status))
        # Gives the front panel back, which nobody turns here.
        self.tree.add("*RMTOFF", command=bare(lambda: None))
        self.tree.add("SYSTem:ERRor", query=bare(self._next_error))

    def _next_error(self) -> str:
        error = self.errors.pop()
        if error.number == 0:
            return "0,No Error"
        code, text = _KINDS.get(error.number, _COMMAND)
        return f"{code},{text}"

    def _add_commands(self) -> None:
        add = self.tree.add
        add("MAIN:FUNCtion", command=self._set_function, query=bare(lambda: f"{self._function} MODE"))
        add("MANU:EDIT:MODE", command=self._set_mode, query=bare(lambda: self._mode))
        add("MANU:IR:VOLTage", command=self._set_voltage, query=bare(lambda: f"{self._voltage:.3f}kV"))
        add("MANU:IR:RHISet", command=self._set_high, query=bare(lambda: f"{self._high:04.0f}M ohm"))
        add("MANU:IR:RLOSet", command=self._set_low, query=bare(lambda: f"{self._low:04.0f}M ohm"))
        add("MANU:IR:REFerence", command=self._set_reference, query=bare(lambda: f"{self._reference:04.0f}M ohm"))
        add("TEST:RETurn", command=self._set_tells, query=bare(lambda: f"TEST:RETURN {'ON' if self._tells else 'OFF'}"))
        add("MANU:IR:TTIMe", command=self._set_test_time, query=bare(lambda: f"{self._test_time:05.1f} S"))
        add("MANU:RTIMe", command=self._set_ramp_time, query=bare(lambda: f"{self._ramp_time:05.1f} S"))
        add("FUNCtion:TEST", command=self._switch, query=bare(lambda: f"TEST {'ON' if self._busy else 'OFF'}"))
        add("MEASure", query=bare(lambda: self._measured()))

    # settings

    def _set_function(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._check_idle()
        self._function = choice(call.arguments[0], _FUNCTIONS)

    def _set_mode(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._check_idle()
        self._mode = choice(call.arguments[0], _MODES)

    def _set_voltage(self, call: Call) -> None:
        volts = self._value(call, 0.05, 1.0)
        self._voltage = round(volts / _STEP) * _STEP

    def _set_high(self, call: Call) -> None:
        high = round(self._value(call, 2.0, _HIGHEST))
        if high <= self._low:
            raise ScpiError(-222)
        self._high = float(high)

    def _set_low(self, call: Call) -> None:
        low = round(self._value(call, 1.0, _HIGHEST))
        if low >= self._high:
            raise ScpiError(-222)
        self._low = float(low)

    def _set_reference(self, call: Call) -> None:
        self._reference = float(round(self._value(call, 0.0, _HIGHEST)))

    def _set_tells(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._check_idle()
        self._tells = choice(call.arguments[0], _STATES) == "ON"

    def _set_test_time(self, call: Call) -> None:
        self._test_time = round(self._value(call, _SHORTEST, _LONGEST), 1)

    def _set_ramp_time(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._check_idle()
        self._ramp_time = round(number(call.arguments[0], 0.1, _LONGEST), 1)

    def _value(self, call: Call, low: float, high: float) -> float:
        """Return the number of a setting of the IR mode. Raises ScpiError outside that mode and while a test runs."""
        exactly(call.arguments, 1)
        self._check_idle()
        if self._mode != "IR":
            raise ScpiError(-221)
        return number(call.arguments[0], low, high)

    def _check_idle(self) -> None:
        if self._busy:
            raise ScpiError(-221)

    # the test

    @property
    def _busy(self) -> bool:
        return self._begun is not None and self.clock.now() < self._ends

    def _switch(self, call: Call) -> None:
        exactly(call.arguments, 1)
        if choice(call.arguments[0], _STATES) == "ON":
            self._start()
        else:
            self._stop()

    def _start(self) -> None:
        self._check_idle()
        if self._mode != "IR" or self._function != "MANU":
            raise ScpiError(-221)
        now = self.clock.now()
        self._begun, self._verdict = now, "TEST"
        self._test += 1
        number = self._test
        self._decides = now + _INITIAL + self._ramp_time + self._test_time
        self._ends = self._decides + _DISCHARGE
        real = 1000.0 * self._voltage * (1.0 + self._unit.voltage_gain)
        self._insulation.start(real, _INITIAL + self._ramp_time, self._test_time)
        self._world.clock.call_at(self._decides, lambda: self._judge(number))

    def _stop(self) -> None:
        self._insulation.stop()
        if self._verdict == "TEST":
            self._tell_end()
        self._verdict, self._begun = "VIEW", None

    def _tell_end(self) -> None:
        if self._tells:
            self.unasked.append(b"OK" + self.terminator)

    def _judge(self, number: int) -> None:
        """Read voltage and resistance at the end of the test time, and switch the output off."""
        with self._world.lock:
            if number != self._test or self._verdict != "TEST":
                return
            shown, resistance = self._reading(self._decides)
            self._insulation.stop()
            self._shown = f"{shown},T={self._test_time:05.1f}S"
            self._verdict = "PASS" if self._low <= resistance <= self._high else "FAIL"
            self._tell_end()

    def _measured(self) -> str:
        with self._world.lock:
            if self._verdict == "TEST" and self.clock.now() >= self._decides:
                # The alarm of a clock that goes with the wall's may come later than this message.
                self._judge(self._test)
            if self._verdict == "VIEW":
                return f"IR ,VIEW ,{self._insulation.voltage() * 1e-3:.3f}kV,0000M ohm,---.-S"
            if self._verdict != "TEST" or self._begun is None:
                return f"IR ,{self._verdict:<5},{self._shown}"
            passed = self.clock.now() - self._begun
            shown, _ = self._reading(self.clock.now())
            rising = passed < _INITIAL + self._ramp_time
            clock = f"R={passed:05.1f}S" if rising else f"T={passed - _INITIAL - self._ramp_time:05.1f}S"
            return f"IR ,TEST ,{shown},{clock}"

    def _reading(self, at: float) -> tuple[str, float]:
        """Return voltage and resistance at a time (s) as shown, and the resistance (MΩ) that it judges by."""
        volts, ohms = self._insulation.voltage(at), self._insulation.resistance(at)
        noise = 1.0 + float(self._random.normal(0.0, self._unit.noise))
        measured = min(ohms * (1.0 + self._unit.resistance_gain) * noise * 1e-6, _HIGHEST)
        # What is open shows as more than its range whatever the reference.
        megohms = float(round(measured if measured == _HIGHEST else max(0.0, measured - self._reference)))
        return f"{volts * 1e-3:.3f}kV,{megohms:04.0f}M ohm", megohms
