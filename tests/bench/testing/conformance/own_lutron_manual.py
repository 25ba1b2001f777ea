"""What is known of the tachometer's frames, written without looking at the driver."""

import math

from bench.testing.conformance.manual import Manual, Reply
from drivers.interfaces import Accuracy, CommunicationError, Identity, MeasurementError

_RPM = 2.0 * math.pi / 60.0
LUTRON = Manual(
    identity=Identity("Lutron", "DT-2236"),
    # A frame a second, a little late at most; 9600 baud, and two periods are waited for it.
    takes={"measure_speed": (1.01, 1.03)},
    port={"baudrate": 9600, "bytesize": 8, "parity": "N", "stopbits": 1, "timeout": 2.0},
    accuracies={
        "speed reading": Accuracy(offset=_RPM, resolution=0.1 * _RPM),
        "speed reading below 1000 rpm": Accuracy(offset=_RPM, resolution=0.1 * _RPM),
        "speed reading above 1000 rpm": Accuracy(offset=_RPM, resolution=_RPM),
    },
    replies=(
        Reply("frame", b"\x0241220100001234\r", reads={"value": 123.4 * _RPM, "accuracy.resolution": 0.1 * _RPM}),
        Reply("frame", b"\x0241221100001234\r", reads={"value": 123.4 * _RPM}),
        Reply("frame", b"\x0241220300001234\r", reads={"value": 1.234 * _RPM}),
        Reply("frame", b"", CommunicationError, says="sends nothing"),
        # Four frames' length without an end is none.
        Reply("frame", 80 * b"0", CommunicationError, within=0.1),
        Reply("frame", b"\x0241210100001234\r", MeasurementError, says="21"),
        Reply("frame", b"\x0241220000099999\r", reads={"value": 99_999 * _RPM}),
        Reply("frame", b"\x0241220000100001\r", MeasurementError),
        Reply("frame", b"\x02412201 0001234\r", CommunicationError),
        Reply("frame", b"\x0241222100001234\r", CommunicationError),
        Reply("frame", b"\x0241220400001234\r", CommunicationError),
        Reply("frame", b"\x0242220100001234\r", CommunicationError),
        Reply("frame", b"\x0241??0100001234\r", CommunicationError),
        Reply("frame", b"?41220100001234\r", CommunicationError, says="no frame between"),
        Reply("frame", b"\x024122010000123\r", CommunicationError),
        Reply("frame", b"\x02412201000012345\r", CommunicationError),
    ),
)
