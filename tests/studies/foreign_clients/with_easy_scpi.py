"""Calls of easy-scpi: headers as attributes, on the voltmeter, the bridge and the supply."""

import math

from calls import TRUTH, Calls, address, hands
from easy_scpi import Instrument


def opened(role):
    """Return an instrument over its socket."""
    made = Instrument(
        address(role, "socket"), port_match=False, backend="@py", read_termination="\n", write_termination="\n"
    )
    made.connect()
    return made


def near(truth):
    """Return what says whether a reply is within 3 % of a figure."""
    return lambda found: math.isclose(float(found), truth, rel_tol=0.03)


hands("turn_shaft", speed=0.0)
meter = opened("voltmeter")
calls = Calls("easy-scpi 34461A", lambda: meter.syst.err())
calls.make("id", lambda: meter.id, lambda found: "34461A" in found)
calls.make("meas.fres()", lambda: meter.meas.fres(query=True), near(TRUTH["resistance"]))
calls.make("conf.volt.dc(10)", lambda: meter.conf.volt.dc(10))
calls.make("volt.dc.nplc(10)", lambda: meter.volt.dc.nplc(10))
calls.make("volt.dc.nplc()", lambda: meter.volt.dc.nplc(), near(10.0))
calls.make("read()", lambda: meter.query("READ?"), lambda found: abs(float(found)) < 10.0)
calls.make("conf.cap()", lambda: meter.conf.cap(""))
calls.make("read() after what was refused", lambda: meter.query("READ?"), lambda _: False)
supply = opened("supply")
calls = Calls("easy-scpi E36313A", lambda: supply.syst.err())
calls.make("volt(5, '(@1)')", lambda: supply.volt(5, "(@1)"))
calls.make("volt('(@1)')", lambda: supply.query("VOLT? (@1)"), near(5.0))
calls.make("volt(500)", lambda: supply.volt(500))
calls.make("outp.prot.cle('(@1)')", lambda: supply.outp.prot.cle("(@1)"))
bridge = opened("lcr_meter")
calls = Calls("easy-scpi E4980A", lambda: bridge.syst.err())
calls.make("func.imp('LSRS')", lambda: bridge.func.imp("LSRS"))
calls.make("freq(100)", lambda: bridge.freq(100))
calls.make("freq()", lambda: bridge.freq(), near(100.0))
calls.make("fetc()", lambda: bridge.fetc(), lambda found: found.endswith(",+0"))
