"""What the GPT-9800's manual states, written without looking at the driver."""

from bench.testing.conformance.manual import Manual, Model, NotYet, Reply, StatedLimits
from drivers.interfaces import CommunicationError, Identity, MeasurementError, ReportedError


def _shown(status: str, kilovolts: str, resistance: str, time: str) -> bytes:
    return f"IR ,{status} ,{kilovolts}kV,{resistance} ohm,{time}S".encode()


GPT9800 = Manual(
    local=r"^\*RMTOFF$",
    identity=Identity("GW Instek", "GPT-9803", "EM110867", "v2.08"),
    models=(Model(options={"ramp_time": 0.5}, holds={"MANU:RTIM?": "000.5 S"}),),
    limits=(
        StatedLimits("measure", "voltage", 50.0, 1000.0, {"duration": 1.0}, step=50.0),
        StatedLimits("measure", "duration", 1.0, 999.9, {"voltage": 500.0}),
    ),
    replies=(
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=000.4"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.400", "0370M", "T=001.0"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "R=001.0"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "---.-"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370k", "T=001.0"), CommunicationError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=001.0"), reads={"resistance.value": 370e6, "voltage": 500.0}),
        Reply(
            "MEAS", _shown("PASS", "0.500", "2.500G", "T=001.0"), reads={"resistance.value": 2.5e9, "beyond_range": 0}
        ),
        Reply("MEAS", _shown("PASS", "0.500", ">9.999G", "T=001.0"), reads={"beyond_range": 1}),
        Reply("MEAS", _shown("PASS", "0.500", "9999M", "T=001.0"), reads={"beyond_range": 1}),
        Reply("MEAS", _shown("FAIL", "0.500", "0001M", "T=000.1"), reads={"resistance.value": 1e6, "beyond_range": 0}),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=000.9"), reads={"resistance.value": 370e6}),
        Reply("MEAS", _shown("PASS", "0.500", "0370M", "T=000.8"), MeasurementError, call="measure"),
        Reply("MEAS", _shown("PASS", "0.491", "0370M", "T=001.0"), reads={"voltage": 491.0}),
        Reply(
            "MEAS", _shown("PASS", "0.489", "0370M", "T=001.0"), MeasurementError, call="measure", says="489 V of 500 V"
        ),
        Reply("MEAS", _shown("FAIL", "0.500", "0001M", "R=000.1"), reads={"resistance.value": 1e6}),
        Reply("MEAS", _shown("FAIL", "0.500", "0002M", "T=000.1"), MeasurementError, call="measure"),
        Reply(
            "MEAS", _shown("PASS", "0.500", "9998M", "T=001.0"), reads={"resistance.value": 9.998e9, "beyond_range": 0}
        ),
        Reply("MEAS", b"nothing", CommunicationError, call="make_safe"),
        Reply("MEAS", b"GB ,VIEW ,00.00A ,000.0mohm,T=000.0S", None, call="make_safe", within=0.05),
        Reply("MEAS", _shown("VIEW", "0.029", "0370M", "---.-"), None, call="make_safe", within=0.05),
        Reply("MEAS", _shown("VIEW", "0.031", "0370M", "---.-"), ReportedError, call="make_safe", says="31 V"),
        Reply("MEAS", _shown("TEST", "0.500", "0370M", "T=000.5"), MeasurementError, call="measure", says="3 s"),
        Reply(r"FUNC:TEST\?", b"OFF", None),
        Reply(r"MANU:IR:VOLT\?", b"0.450kV", ReportedError),
    ),
    not_yet=(
        NotYet(r"FUNC:TEST\?", b"TEST ON", 5.0),
        # A judged test may go on showing its voltage.
        NotYet("MEAS", _shown("PASS", "0.500", "0370M", "T=001.0"), 1.0, call="make_safe", told=False),
        NotYet("MEAS", _shown("TEST", "0.499", "0369M", "T=000.9"), 5.0),
    ),
)
#: The test has three seconds more than its ramp and its time, whatever they are.
GPT9800_SLOW = {
    "ramp_time": 5.0,
    "manual": Manual(not_yet=(NotYet("MEAS", _shown("TEST", "0.000", "0369M", "T=000.9"), 3.0, call="measure"),)),
}
